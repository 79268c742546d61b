// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_run.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "problems/config/config.h"
#include "problems/experiment/metrics/statistics.h"
#include "problems/population/population_report.h"
#include "problems/population/population_result.h"
#include "problems/subject/dowel_depths.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/phantom.h"
#include "problems/subject/phantom_ct.h"
#include "problems/subject/propose/mean_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ScratchFolder;
using testing::WordsOf;

constexpr int kCount = 8;

PopulationPlan Phantoms(const ScratchFolder& folder, const std::string& more = "") {
  WriteFileAtomically(folder / "crowd.yaml",
                      fmt::format("title: crowd\nphantoms: {{count: {}, like: {{rings: 16}}}}\n"
                                  "measure: {{dense: {{columns: 16, rows: 16, modes: 1}}}}\n{}",
                                  kCount, more));
  return ReadPopulation(folder / "crowd.yaml");
}

PopulationResult Analysed(const PopulationPlan& plan, const fs::path& folder) {
  return AnalysePopulation(plan, ReadMeasured(plan, folder));
}

// Writes meshes and landmarks of a phantom as in a user's folder.
void WriteHead(const fs::path& folder, std::uint64_t random_seed, bool with_landmarks) {
  const Phantom phantom = MakePhantom({.random_seed = random_seed, .rings = 32});
  fs::create_directories(folder);
  WriteFileAtomically(folder / "skull.ply", EncodeMesh(phantom.skull, ".ply"));
  WriteFileAtomically(folder / "skin.ply", EncodeMesh(phantom.face, ".ply"));
  if (with_landmarks) {
    WriteFileAtomically(
        folder / "landmarks.yaml",
        EncodeLandmarks(PhantomLandmarks(phantom.sites, random_seed), "landmarks.yaml"));
  }
}

// Writes a phantom as a CT of coarse voxels, as NRRD.
void WriteVolume(const fs::path& file, std::uint64_t random_seed) {
  const CtVolume volume = VoxelisePhantom(MakePhantom({.random_seed = random_seed, .rings = 32}),
                                          {.pixel_mm = 4, .slice_mm = 3});
  std::string bytes = fmt::format(
      "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: {} {} {}\n"
      "space directions: ({},0,0) (0,{},0) (0,0,{})\nendian: little\nencoding: raw\n"
      "space origin: ({},{},{})\n\n",
      volume.columns, volume.rows, volume.slices, volume.spacing_mm.x(), volume.spacing_mm.y(),
      volume.spacing_mm.z(), volume.origin.x(), volume.origin.y(), volume.origin.z());
  for (const std::int16_t value : volume.values) {
    bytes += static_cast<char>(value & 0xFF);
    bytes += static_cast<char>(value >> 8 & 0xFF);
  }
  WriteFileAtomically(file, bytes);
}

std::vector<std::string> NamesOf(const PopulationPlan& plan) {
  std::vector<std::string> names;
  for (const PopulationEntry& entry : plan.entries) {
    names.push_back(entry.subject.name);
  }
  return names;
}

std::string FaultOf(const PopulationPlan& plan, const std::string& name) {
  for (const PopulationEntry& entry : plan.entries) {
    if (entry.subject.name == name) {
      return entry.subject.fault;
    }
  }
  return "there is no subject " + name;
}

TEST(MeasurePopulation, ContinuesWhereItStoppedAndShardsGiveTheSameBytes) {
  const ScratchFolder folder;
  constexpr int kFew = 4;
  PopulationPlan plan = Phantoms(folder);
  plan.entries.resize(kFew);
  EXPECT_EQ(MeasurePopulation(plan, folder / "a", {.jobs = 2}, {}).done, kFew);
  const std::string first = "subjects/" + plan.entries[1].id + ".json";
  const std::string bytes = ReadFileBytes(folder / "a" / first);
  fs::remove(folder / "a" / first);
  WriteFileAtomically(folder / "a" / ("subjects/" + plan.entries[2].id + ".json"), "{\"id\": ");
  const std::string& damaged = plan.entries[3].id;
  const std::string good = ReadFileBytes(folder / "a" / ("subjects/" + damaged + ".json"));
  for (const auto& [from, to] :
       {std::pair{"\"done\"", "[]"}, std::pair{"\"depths\"", "\"deep\""},
        std::pair{"\"site\":\"g\"", "\"site\":\"gg\""},
        std::pair{"\"columns\":16", "\"columns\":-16"}, std::pair{"\"rows\":16", "\"rows\":1.5e99"},
        std::pair{"\"bone\":[", "\"bone\":[-1e308,"}}) {
    std::string changed = good;
    const std::size_t at = changed.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    WriteFileAtomically(folder / "a" / ("subjects/" + damaged + ".json"),
                        changed.replace(at, std::string(from).size(), to));
    EXPECT_EQ(ReadMeasured(plan, folder / "a").at(3).status, "missing") << to;
  }
  fs::remove(folder / "a" / ("subjects/" + damaged + ".json"));
  ASSERT_EQ(::mkfifo((folder / "a" / ("subjects/" + damaged + ".json")).c_str(), 0600), 0);
  EXPECT_EQ(ReadMeasured(plan, folder / "a").at(3).status, "missing");
  const PopulationRunSummary again = MeasurePopulation(plan, folder / "a", {}, {});
  EXPECT_EQ(again.skipped, kFew - 3);
  EXPECT_EQ(again.done, 3);
  EXPECT_EQ(ReadFileBytes(folder / "a" / first), bytes);
  EXPECT_EQ(MeasurePopulation(plan, folder / "b", {.shard = 0, .shards = 2}, {}).done, kFew / 2);
  EXPECT_EQ(MeasurePopulation(plan, folder / "c", {.shard = 1, .shards = 2}, {}).done, kFew / 2);
  const auto from = GatherSubjects(plan, folder / "b", {folder / "c", folder / "a"});
  EXPECT_EQ(from.at(0).held, kFew / 2);
  EXPECT_EQ(from.at(0).taken, kFew / 2);
  EXPECT_EQ(from.at(1).held, kFew);
  EXPECT_EQ(from.at(1).taken, 0);
  OutputFolder whole(folder / "a", WhenNotEmpty::kReplaceFiles),
      gathered(folder / "b", WhenNotEmpty::kReplaceFiles);
  WritePopulation(Analysed(plan, folder / "a"), whole);
  WritePopulation(Analysed(plan, folder / "b"), gathered);
  EXPECT_THAT(whole.Written(), ::testing::ElementsAreArray(kPopulationFiles));
  for (const std::string_view file : kPopulationFiles) {
    EXPECT_EQ(ReadFileBytes(folder / "a" / file), ReadFileBytes(folder / "b" / file)) << file;
  }
}

RunContext OnThreads(int threads) { return {.on_event = {}, .stop_token = {}, .threads = threads}; }

// A phantom is no human skull, so the landmarks come from another phantom.
TEST(MeasurePopulation, OfVolumesInAFolderGoesOnAfterBadOnesAndShardsGiveTheSameTableThorough) {
  const ScratchFolder folder;
  fs::create_directories(folder / "heads/d");
  for (const auto& [file, seed] : {std::pair{"a.nrrd", 1}, {"b.nrrd", 2}, {"c.nrrd", 3}}) {
    WriteVolume(folder / "heads" / file, seed);
  }
  WriteFileAtomically(folder / "heads/bad.nrrd", "NRRD0004\nsizes: many\n");
  WriteFileAtomically(folder / "heads/d/skull.ply", "ply\n");
  WriteHead(folder / "reference", 9, /*with_landmarks=*/true);
  WriteFileAtomically(folder / "heads/population.yaml",
                      "measure: {dense: {columns: 8, rows: 8, modes: 0}, references: [{skull: "
                      "../reference/skull.ply, landmarks: ../reference/landmarks.yaml}]}\n");
  const PopulationPlan plan = ReadPopulation(folder / "heads");
  const PopulationRunSummary whole =
      MeasurePopulation(plan, folder / "whole", {.jobs = 2}, OnThreads(1));
  EXPECT_EQ(whole.done, 3);
  EXPECT_EQ(whole.failed, 2);
  const PopulationResult result = Analysed(plan, folder / "whole");
  EXPECT_THAT(result.subjects.at(2).reason, HasSubstr("bad.nrrd"));
  EXPECT_THAT(result.subjects.at(4).reason, HasSubstr("it has a skull and no skin"));
  EXPECT_GT(result.table.rows.size(), 10u);
  MeasurePopulation(plan, folder / "parts", {.shard = 0, .shards = 2}, OnThreads(3));
  MeasurePopulation(plan, folder / "other", {.shard = 1, .shards = 2}, OnThreads(2));
  GatherSubjects(plan, folder / "parts", {folder / "other"});
  OutputFolder out(folder / "whole", WhenNotEmpty::kReplaceFiles),
      gathered(folder / "parts", WhenNotEmpty::kReplaceFiles);
  WritePopulation(result, out);
  WritePopulation(Analysed(plan, folder / "parts"), gathered);
  for (const std::string_view file : kPopulationFiles) {
    EXPECT_EQ(ReadFileBytes(folder / "whole" / file), ReadFileBytes(folder / "parts" / file))
        << file;
  }
}

// The mean skull is upright; its own shape, made larger, is its skin.
TEST(MeasurePopulation, WithoutAnyReferenceTheMeanSkullProposesTheLandmarks) {
  const ScratchFolder folder;
  const TriMesh skull = ReadMeanSkull().head.shell.mesh;
  TriMesh skin = skull;
  const Vec3 middle = Bounds(skull).center();
  for (Vec3& p : skin.points) {
    p = middle + 1.12 * (p - middle);
  }
  fs::create_directories(folder / "heads/a");
  WriteFileAtomically(folder / "heads/a/skull.ply", EncodeMesh(skull, ".ply"));
  WriteFileAtomically(folder / "heads/a/skin.ply", EncodeMesh(skin, ".ply"));
  const PopulationPlan plan = ReadPopulation(folder / "heads");
  MeasurePopulation(plan, folder / "out", {}, {});
  const MeasuredSubject measured = ReadMeasured(plan, folder / "out").at(0);
  ASSERT_EQ(measured.status, "done") << measured.reason;
  EXPECT_TRUE(measured.depths.proposed);
  EXPECT_EQ(measured.depths.sites.size(), 32u);  // those without a depth state why
  int with_depth = 0;
  for (const SiteDepth& site : measured.depths.sites) {
    EXPECT_EQ(std::isfinite(site.depth_mm), site.why_not.empty()) << site.site;
    with_depth += std::isfinite(site.depth_mm) ? 1 : 0;
  }
  EXPECT_GT(with_depth, 15);
}

// The depths of phantoms are known; their coarse meshes have small errors.
TEST(AnalysePopulation, MeasuresPhantomsAndMakesATable) {
  const ScratchFolder folder;
  const PopulationPlan plan = Phantoms(folder);
  MeasurePopulation(plan, folder / "out", {.jobs = 2}, {});
  const PopulationResult result = Analysed(plan, folder / "out");
  ASSERT_EQ(result.Count("done"), kCount);
  double squares = 0;
  int count = 0;
  for (int k = 0; k < kCount; ++k) {
    const Phantom truth = MakePhantom(std::get<PhantomOptions>(plan.entries[k].subject.subject));
    for (const PhantomSite& site : truth.sites) {
      const auto& sites = result.subjects[k].depths.sites;
      const auto found = std::ranges::find(sites, site.site, &SiteDepth::site);
      if (std::isfinite(found->depth_mm)) {
        squares += std::pow(found->depth_mm - site.depth_mm, 2);
        ++count;
      }
    }
  }
  EXPECT_GT(count, kCount * 30);
  EXPECT_LT(std::sqrt(squares / count), 1);
  EXPECT_EQ(result.table.rows.size(), 21u);
  EXPECT_GT(std::ranges::count(result.dense.used, true), 80);
  EXPECT_GT(result.dense.share[0], 0.3);  // a phantom is thick or thin all over
  WriteFileAtomically(folder / "table.yaml", WriteConfig(result.table));
  const TissueTable table = ReadTissueTable(folder / "table.yaml");
  ASSERT_TRUE(table.correlations.has_value());
  EXPECT_EQ(table.correlations->subjects, kCount);
  EXPECT_EQ(table.correlations->covariates.at(0).name, "bmi");
  EXPECT_EQ(FindDepth(table, Sex::kMale, Build::kNormal, "go_l")->n, kCount);
}

// The true depths of the phantoms at a landmark, with both sides of a pair as one, as in a table.
struct TrueDepths {
  double mean_mm = 0, variance_mm2 = 0;
};

TrueDepths TrueDepthsAt(const std::vector<Phantom>& phantoms, const std::string& landmark) {
  TrueDepths truth;
  int sides = 0;
  for (std::size_t s = 0; s < phantoms[0].sites.size(); ++s) {
    if (WithoutSide(phantoms[0].sites[s].site) == landmark) {
      std::vector<double> depths;
      std::ranges::transform(phantoms, std::back_inserter(depths),
                             [&](const Phantom& phantom) { return phantom.sites[s].depth_mm; });
      const SampleSummary summary = Summarize(depths);
      truth.mean_mm += summary.mean;
      truth.variance_mm2 += summary.sd * summary.sd;
      ++sides;
    }
  }
  return {truth.mean_mm / sides, truth.variance_mm2 / sides};
}

// Errors that all heads share do not average out, so each site has its own limit: chords of such a
// coarse mesh are off by 0.1 mm where bone and skin curve most (me), in all heads alike.
TEST(AnalysePopulation, OfManyPhantomsHasTheTrueMeansAndDeviations) {
  constexpr int kMany = 40;  // small ones: some 50 ms each
  constexpr double kChord_mm = 0.12, kScatter_mm = 0.03, kShare = 0.02;
  const ScratchFolder folder;
  WriteFileAtomically(folder / "many.yaml",
                      fmt::format("phantoms: {{count: {}, like: {{rings: 40}}}}\n"
                                  "measure: {{dense: {{columns: 8, rows: 8, modes: 0}}}}\n",
                                  kMany));
  const PopulationPlan plan = ReadPopulation(folder / "many.yaml");
  MeasurePopulation(plan, folder / "out", {.jobs = 2}, {});
  const PopulationResult result = Analysed(plan, folder / "out");
  std::map<std::string, std::vector<double>> errors_mm;
  std::vector<Phantom> phantoms;
  for (const MeasuredSubject& subject : result.subjects) {
    ASSERT_EQ(subject.status, "done") << subject.reason;
    phantoms.push_back(MakePhantom(std::get<PhantomOptions>(subject.person.subject)));
    for (const PhantomSite& site : phantoms.back().sites) {
      const auto at = std::ranges::find(subject.depths.sites, site.site, &SiteDepth::site);
      errors_mm[site.site].push_back(at->depth_mm - site.depth_mm);
    }
  }
  ASSERT_EQ(errors_mm.size(), 32u);
  for (const auto& [site, list] : errors_mm) {
    const SampleSummary summary = Summarize(list);
    EXPECT_EQ(summary.n, kMany) << site;
    EXPECT_LT(std::abs(summary.mean), kChord_mm) << site;
    EXPECT_LT(summary.sd, kScatter_mm) << site;
  }
  ASSERT_EQ(result.table.rows.size(), 21u);
  for (const TissueRow& row : result.table.rows) {
    const TrueDepths truth = TrueDepthsAt(phantoms, row.site);
    const TissueCell& cell = row.values.at("adult");
    EXPECT_NEAR(*cell.mean, truth.mean_mm, kChord_mm) << row.site;
    EXPECT_NEAR(*cell.sd / std::sqrt(truth.variance_mm2), 1, kShare) << row.site;
    EXPECT_EQ(cell.n, kMany) << row.site;
  }
}

TEST(MeasurePopulation, AFailureIsRecordedWithItsReason) {
  const ScratchFolder folder;
  PopulationPlan plan = Phantoms(folder);
  plan.entries.resize(4);
  WriteFileAtomically(folder / "broken.ply", "ply\n");
  FileSubject broken;
  broken.skull = broken.skin = broken.landmarks = folder / "broken.ply";
  plan.entries[0].subject.subject = broken;
  const PopulationRunSummary summary = MeasurePopulation(plan, folder / "out", {}, {});
  EXPECT_EQ(summary.failed, 1);
  const PopulationResult result = Analysed(plan, folder / "out");
  EXPECT_EQ(result.Count("failed"), 1);
  EXPECT_FALSE(result.subjects[0].reason.empty());
  EXPECT_EQ(result.counted.size(), 3u);
}

TEST(GatherSubjects, AFolderWithoutSubjectsIsRefusedBeforeAnythingIsCopied) {
  const ScratchFolder folder;
  PopulationPlan plan = Phantoms(folder);
  plan.entries.resize(1);
  MeasurePopulation(plan, folder / "a", {}, {});
  const auto refused = [&](const char* other) {
    return WordsOf<IoError>([&] {
      GatherSubjects(plan, folder / "b", {folder / "a", folder / other});
    });
  };
  EXPECT_THAT(refused("nowhere"), HasSubstr("nowhere: the folder does not exist"));
  fs::create_directories(folder / "empty");
  EXPECT_THAT(refused("empty"), HasSubstr("empty: it contains no subjects/"));
  EXPECT_FALSE(fs::exists(folder / "b"));
}

TEST(RefuseOtherFolder, AcceptsOnlyThisPopulation) {
  const ScratchFolder folder;
  PopulationPlan plan = Phantoms(folder);
  plan.entries.resize(3);
  const auto words = [&](const char* name) {
    return WordsOf<IoError>([&] { RefuseOtherFolder(plan, folder / name); });
  };
  RefuseOtherFolder(plan, folder / "missing");
  // Another shard has just created the folder.
  fs::create_directories(folder / "begun/subjects");
  WriteFileAtomically(folder / "begun/.semblance-00000000000000a7.tmp", "");
  WriteFileAtomically(folder / "begun/subjects/.semblance-0123456789abcdef.tmp", "");
  RefuseOtherFolder(plan, folder / "begun");
  fs::create_directories(folder / "foreign");
  WriteFileAtomically(folder / "foreign/report.html", "a study's");
  EXPECT_THAT(words("foreign"), HasSubstr("not empty and contains no population"));
  EXPECT_THAT(words("foreign"), HasSubstr("--force"));
  const auto measured = [&](const char* name, const std::string& id) {
    fs::create_directories(folder / name / "subjects");
    WriteFileAtomically(folder / name / "subjects" / (id + ".json"), "{}");
  };
  measured("other", "0123456789ab");
  EXPECT_THAT(words("other"), HasSubstr("none of its subjects has the same files"));
  measured("ours", plan.entries[2].id);
  RefuseOtherFolder(plan, folder / "ours");
  const auto with_results = [&](const std::string& json) {
    WriteFileAtomically(folder / "ours/population.json", json);
  };
  with_results("{\"title\": \"crowd\"}");  // of a version without an id
  RefuseOtherFolder(plan, folder / "ours");
  with_results("{\"title\": \"crowd\", \"id\": \"population\"}");
  RefuseOtherFolder(plan, folder / "ours");
  with_results("{\"title\": \"crowd\", \"id\": \"forty\"}");
  EXPECT_THAT(words("ours"), HasSubstr("'crowd' (id forty); this is 'crowd' (id population)"));
  with_results("{\"title\": \"others\"}");
  EXPECT_THAT(words("ours"), HasSubstr("another population, 'others'"));
}

TEST(AnalysePopulation, OfTooFewStatesWhyAndWhoFailed) {
  const ScratchFolder folder;
  PopulationPlan plan = Phantoms(folder);
  plan.entries.resize(3);
  std::vector<MeasuredSubject> subjects = ReadMeasured(plan, folder / "nothing");
  subjects[1].status = "failed";
  subjects[1].reason = "no bone";
  EXPECT_THAT(WhyNoTable(plan, subjects),
              HasSubstr("0 subjects are measured (1 failed, 2 missing); a population needs at"));
  EXPECT_EQ(WordsOf<InputError>([&] { AnalysePopulation(plan, subjects); }),
            WhyNoTable(plan, subjects));
  OutputFolder out(folder / "out", WhenNotEmpty::kRefuse);
  WriteSubjects(subjects, out);
  EXPECT_THAT(ReadFileBytes(folder / "out/subjects.csv"), HasSubstr("failed,no bone,"));
  for (MeasuredSubject& subject : subjects) {
    subject.status = "done";
  }
  EXPECT_EQ(WhyNoTable(plan, subjects), "");
}

TEST(AnalysePopulation, NotesUnsearchedOutliersAndMissingDeviations) {
  const ScratchFolder folder;
  const std::string tables = SEMBLANCE_SOURCE_DIR "/configs/tables/";
  PopulationPlan plan = Phantoms(folder, fmt::format("tables: [{}rhine_caucasoid.yaml]\n", tables));
  plan.entries.resize(4);
  MeasurePopulation(plan, folder / "out", {.jobs = 2}, {});
  const PopulationResult few = Analysed(plan, folder / "out");
  EXPECT_THAT(few.notes, Contains("fewer than 8 subjects: outliers are not searched for"));
  EXPECT_THAT(few.notes, Contains(HasSubstr("the sex or build of 4 of 4 subjects is not known")));
  const std::string text = PopulationText(few);
  EXPECT_THAT(text, HasSubstr("\noutliers not searched for\n"));
  EXPECT_THAT(text, HasSubstr("no sd stated"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
  EXPECT_THAT(PopulationReport(few), HasSubstr("The search needs at least 8 subjects"));
  // Eight subjects are enough, but not at a site that one of them lacks.
  std::vector<MeasuredSubject> subjects = ReadMeasured(plan, folder / "out");
  for (int k = 0; k < 4; ++k) {
    MeasuredSubject twin = subjects[k];
    for (SiteDepth& site : twin.depths.sites) {
      site.depth_mm += 0.1 * (k + 1);
    }
    subjects.push_back(twin);
  }
  subjects[0].depths.sites[0].depth_mm = kNaN;
  const PopulationResult eight = AnalysePopulation(plan, subjects);
  EXPECT_THAT(eight.notes, Contains(HasSubstr("not searched for at 1 of 32 sites")));
  EXPECT_THAT(PopulationText(eight), HasSubstr("0 outliers"));
}

// A proposal contains no person's mistake, so its other sites remain valid.
TEST(MeasureSubject, OfProposedLandmarksAtOnePointTheMostConfidentCounts) {
  const Phantom phantom = MakePhantom({.random_seed = 4, .rings = 32});
  const ScratchFolder folder;
  LandmarkFile landmarks = PhantomLandmarks(phantom.sites, 4);
  Landmark& pg = *std::ranges::find(landmarks.landmarks, "pg", &Landmark::site);
  Landmark& sm = *std::ranges::find(landmarks.landmarks, "sm", &Landmark::site);
  sm.point = pg.point;
  sm.certainty = Certainty::kHigh;
  pg.certainty = Certainty::kLow;
  WriteFileAtomically(folder / "skull.ply", EncodeMesh(phantom.skull, ".ply"));
  WriteFileAtomically(folder / "skin.ply", EncodeMesh(phantom.face, ".ply"));
  FileSubject files;
  files.skull = folder / "skull.ply";
  files.skin = folder / "skin.ply";
  files.landmarks = folder / "landmarks.yaml";
  const auto measured = [&](bool proposed) {
    landmarks.proposed = proposed;
    WriteFileAtomically(files.landmarks, EncodeLandmarks(landmarks, "landmarks.yaml"));
    return MeasureSubject({.name = "s4", .subject = files}, {}, {}, {});
  };
  EXPECT_THAT(WordsOf<InputError>([&] { measured(/*proposed=*/false); }),
              HasSubstr("have the same point"));
  const SubjectDepths depths = measured(/*proposed=*/true);
  ASSERT_EQ(depths.sites.size(), landmarks.landmarks.size());
  for (const SiteDepth& site : depths.sites) {
    EXPECT_EQ(std::isfinite(site.depth_mm), site.site != "pg") << site.site << site.why_not;
  }
  EXPECT_EQ(depths.sites.back().site, "pg");
  EXPECT_THAT(depths.sites.back().why_not, HasSubstr("proposed at the point of sm"));
  EXPECT_THAT(depths.notes, Contains(HasSubstr("pg: proposed at the point of sm")));
}

TEST(ReadPopulation, RefusesUnknownSites) {
  const ScratchFolder folder;
  const auto words = [&](const std::string& more) {
    return WordsOf<Error>([&] { Phantoms(folder, more); });
  };
  EXPECT_THAT(words("known: [g, zx_l]\n"),
              HasSubstr("known: unknown site 'zx_l'; did you mean 'zy_l'?"));
  EXPECT_THAT(words("subjects: [{name: a, exclude: [xx], subject: {type: phantom}}]\n"),
              HasSubstr("subjects[0].exclude: unknown site 'xx'; known are: "));
  EXPECT_EQ(SiteCodesFault({"g", "go", "go_l", "mmb"}), "");
  Phantoms(folder, "known: []\n");
}

TEST(ReadPopulation, OfAFolderAcceptsCapitalsAndNotesSkippedFolders) {
  const ScratchFolder folder;
  WriteHead(folder / "heads/a", 1, /*with_landmarks=*/true);
  for (const auto& [from, to] : {std::pair{"skull.ply", "Skull.PLY"},
                                 {"skin.ply", "SKIN.ply"},
                                 {"landmarks.yaml", "Landmarks.yaml"}}) {
    fs::rename(folder / "heads/a" / from, folder / "heads/a" / to);
  }
  for (const char* name : {"b/CT", "c", ".git"}) {
    fs::create_directories(folder / "heads" / name);
  }
  WriteFileAtomically(folder / "heads/b/CT/1.dcm", "");
  WriteFileAtomically(folder / "heads/c/head.ply", "");
  WriteFileAtomically(folder / "heads/.git/config", "");
  const PopulationPlan plan = ReadPopulation(folder / "heads");
  ASSERT_EQ(plan.entries.size(), 2u);
  const auto& files = std::get<FileSubject>(plan.entries[0].subject.subject);
  EXPECT_EQ(files.skin, folder / "heads/a/SKIN.ply");
  EXPECT_EQ(files.landmarks, folder / "heads/a/Landmarks.yaml");
  EXPECT_EQ(std::get<CtSubject>(plan.entries[1].subject.subject).volume, folder / "heads/b/CT");
  EXPECT_THAT(plan.notes, ElementsAre(HasSubstr("c: skipped")));
  WriteFileAtomically(folder / "heads/a/skin.PLY", "");
  EXPECT_THAT(FaultOf(ReadPopulation(folder / "heads"), "a"),
              HasSubstr("both SKIN.ply and skin.PLY are there; keep one"));
}

TEST(ReadPopulation, VolumesInAFolderAreSubjectsAndOtherFilesAreNot) {
  const ScratchFolder folder;
  WriteHead(folder / "heads/f", 1, /*with_landmarks=*/true);
  for (const char* file : {"a.nrrd", "b.NII.GZ", "c.mhd", "c.raw", "d.1.inv3", "README.md",
                           "LICENSE.open-kbp", "depths.csv", "volume.txt", ".hidden.nrrd"}) {
    WriteFileAtomically(folder / "heads" / file, "");
  }
  fs::create_symlink("nowhere", folder / "heads/e.nii");
  WriteFileAtomically(folder / "heads/population.yaml", "import: {skin_hu: -450}\n");
  const PopulationPlan plan = ReadPopulation(folder / "heads");
  EXPECT_THAT(NamesOf(plan), ElementsAre("a", "b", "c", "d.1", "e", "f"));
  EXPECT_EQ(std::get<CtSubject>(plan.entries[1].subject.subject).volume, folder / "heads/b.NII.GZ");
  EXPECT_EQ(std::get<CtSubject>(plan.entries[1].subject.subject).import.skin_hu, -450);
  EXPECT_THAT(plan.notes, ElementsAre());
}

TEST(ReadPopulation, RefusesTwoEntriesOfOneName) {
  const ScratchFolder folder;
  fs::create_directories(folder / "heads");
  WriteFileAtomically(folder / "heads/a.nrrd", "");
  WriteFileAtomically(folder / "heads/a.nii.gz", "");
  const auto words = [&] { return WordsOf<InputError>([&] { ReadPopulation(folder / "heads"); }); };
  EXPECT_THAT(words(), HasSubstr("heads: a.nii.gz and a.nrrd are both the subject 'a'; rename"));
  fs::remove(folder / "heads/a.nii.gz");
  EXPECT_THAT(NamesOf(ReadPopulation(folder / "heads")), ElementsAre("a"));
  WriteHead(folder / "heads/a", 1, /*with_landmarks=*/true);
  EXPECT_THAT(words(), HasSubstr("a and a.nrrd are both the subject 'a'"));
}

TEST(ReadPopulation, RefusesFaultyRowsOfSubjectsCsv) {
  const ScratchFolder folder;
  WriteHead(folder / "heads/anna", 1, /*with_landmarks=*/true);
  WriteHead(folder / "heads/bert", 2, /*with_landmarks=*/true);
  const auto words = [&](const std::string& csv) {
    WriteFileAtomically(folder / "heads/subjects.csv", csv);
    return WordsOf<IoError>([&] { ReadPopulation(folder / "heads"); });
  };
  EXPECT_THAT(words("name,age_years\nbert,20\nanna,-5\n"),
              HasSubstr("subjects.csv:3: age_years is -5; it must be 0 to 130, or empty"));
  EXPECT_THAT(words("name,bmi\nanna,500\n"), HasSubstr(":2: bmi is 500; it must be 8 to 100"));
  EXPECT_THAT(words("name,Age\n"), HasSubstr(":1: unknown column 'Age'; did you mean 'age_years'"));
  EXPECT_THAT(words("name,BMI\n"), HasSubstr("'BMI'; did you mean 'bmi'?"));
  EXPECT_THAT(words("name,bmi\nanna,20\nanna,30\n"), HasSubstr(":3: 'anna' has a row above"));
  EXPECT_THAT(words("name;sex;bmi\nanna;male;20\n"), HasSubstr(":1: semicolons or tabs"));
  EXPECT_THAT(words("name,bmi\nana,20\n"),
              HasSubstr(":2: there is no subject 'ana' in the folder; did you mean 'anna'?"));
  EXPECT_THAT(words("bmi\n"), HasSubstr("there is no column 'name'"));
}

TEST(ReadPopulation, OfAFolderReadsItsSubjectsAndTheirCovariates) {
  const ScratchFolder folder;
  for (const int k : {1, 2, 3}) {
    WriteHead(folder / ("head" + std::to_string(k)), k, /*with_landmarks=*/k != 3);
  }
  WriteFileAtomically(folder / "subjects.csv", "name,sex,bmi\nhead1,female,22.5\nhead3,male,\n");
  const PopulationPlan plan = ReadPopulation(folder.Path());
  ASSERT_EQ(plan.entries.size(), 3u);
  EXPECT_EQ(plan.entries[0].subject.sex, Sex::kFemale);
  EXPECT_EQ(plan.entries[0].subject.bmi, 22.5);
  EXPECT_FALSE(plan.entries[1].subject.sex.has_value());
  EXPECT_EQ(plan.file.measure.references.size(), 2u);
  fs::remove(folder / "head2/skin.ply");
  EXPECT_THAT(FaultOf(ReadPopulation(folder.Path()), "head2"),
              HasSubstr("it has a skull and no skin"));
}

TEST(ReadPopulation, IdsFollowTheContentAndNotTheFolderOrThePerson) {
  const ScratchFolder folder;
  for (const char* place : {"a", "b"}) {
    for (const int k : {1, 2, 3}) {
      WriteHead(folder / place / ("head" + std::to_string(k)), k, /*with_landmarks=*/true);
    }
  }
  const PopulationPlan a = ReadPopulation(folder / "a");
  WriteFileAtomically(folder / "b/subjects.csv", "name,bmi\nhead1,30\n");
  const PopulationPlan b = ReadPopulation(folder / "b");
  EXPECT_EQ(a.entries[0].id, b.entries[0].id);
  WriteHead(folder / "b/head1", 9, /*with_landmarks=*/true);
  EXPECT_NE(a.entries[0].id, ReadPopulation(folder / "b").entries[0].id);
}

}  // namespace
}  // namespace semblance::problems
