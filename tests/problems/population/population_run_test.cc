// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_run.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/config/config.h"
#include "problems/landmark_files/read_landmarks.h"
#include "problems/phantom/phantom_landmarks.h"
#include "problems/population/population_files.h"
#include "problems/subject/dowel_depths.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
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

TEST(MeasurePopulation, GoesOnWhereItWasAndShardsGiveTheSameBytes) {
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
  const PopulationRunSummary again = MeasurePopulation(plan, folder / "a", {}, {});
  EXPECT_EQ(again.skipped, kFew - 3);
  EXPECT_EQ(again.done, 3);
  EXPECT_EQ(ReadFileBytes(folder / "a" / first), bytes);
  EXPECT_EQ(MeasurePopulation(plan, folder / "b", {.shard = 0, .shards = 2}, {}).done, kFew / 2);
  EXPECT_EQ(MeasurePopulation(plan, folder / "c", {.shard = 1, .shards = 2}, {}).done, kFew / 2);
  EXPECT_EQ(GatherSubjects(plan, folder / "b", {folder / "c"}), kFew / 2);
  OutputFolder whole(folder / "a", WhenNotEmpty::kReplaceFiles),
      gathered(folder / "b", WhenNotEmpty::kReplaceFiles);
  WritePopulation(Analysed(plan, folder / "a"), whole);
  WritePopulation(Analysed(plan, folder / "b"), gathered);
  EXPECT_THAT(whole.Written(), ::testing::ElementsAreArray(kPopulationFiles));
  for (const std::string_view file : kPopulationFiles) {
    EXPECT_EQ(ReadFileBytes(folder / "a" / file), ReadFileBytes(folder / "b" / file)) << file;
  }
}

// The phantoms' depths are known: a coarse mesh of them is off by little.
TEST(AnalysePopulation, MeasuresWhatPhantomsAreMadeOfAndMakesATableOfIt) {
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

TEST(MeasurePopulation, AFailureIsARowWithItsReason) {
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

// Meshes and landmarks of a phantom, as a user's folder has them.
void WriteHead(const fs::path& folder, std::uint64_t random_seed, bool with_landmarks) {
  const Phantom phantom = MakePhantom({.random_seed = random_seed, .rings = 32});
  fs::create_directories(folder);
  WriteFileAtomically(folder / "skull.ply", EncodeMesh(phantom.skull, ".ply"));
  WriteFileAtomically(folder / "skin.ply", EncodeMesh(phantom.face, ".ply"));
  if (with_landmarks) {
    WriteFileAtomically(folder / "landmarks.yaml",
                        EncodeLandmarks(PhantomLandmarks(phantom, random_seed), "landmarks.yaml"));
  }
}

TEST(ReadPopulation, OfAFolderTakesItsSubjectsAndWhatIsKnownOfThem) {
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
  EXPECT_THAT(WordsOf<InputError>([&] { ReadPopulation(folder.Path()); }),
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
}  // namespace semblance
