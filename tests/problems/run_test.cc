// SPDX-License-Identifier: GPL-3.0-or-later
// The main job from a configuration to a folder, on a small phantom.
#include "problems/run.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "fitting/terms/metric_distortion.h"
#include "interp/schemes/people.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/input_files.h"
#include "problems/experiment/stage_cache.h"
#include "problems/face/template_source.h"
#include "problems/io/given_files.h"
#include "problems/report/result_json.h"
#include "problems/report/run_folder.h"
#include "problems/report/run_report.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/phantom.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ScratchFolder;
using ::testing::UnorderedElementsAreArray;
using testing::WordsOf;

const fs::path kConfigs = fs::path(SEMBLANCE_SOURCE_DIR) / "configs";

// A phantom that is coarse enough to be quick.
Experiment SmallPhantom(std::vector<std::string> overrides = {}) {
  overrides.insert(overrides.begin(),
                   {"subject.rings=30", "implicit.resolution=28", "template.max_level=2"});
  return ReadConfig<Experiment>(kConfigs / "phantom.yaml", overrides);
}

std::map<std::string, std::string> FilesOf(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[fs::relative(entry.path(), folder).generic_string()] = ReadFileBytes(entry.path());
    }
  }
  return files;
}

std::map<std::string, std::string> FilesOfRun(const Experiment& experiment, const fs::path& folder,
                                              int threads) {
  RunContext context;
  context.threads = threads;
  OutputFolder output(folder, WhenNotEmpty::kRefuse);
  WriteRun(experiment, problems::Run(experiment, context), output, context);
  auto files = FilesOf(folder);
  EXPECT_EQ(files.erase("timing.json"), 1u);
  return files;
}

TEST(Run, ThePhantomsImplicitFaceIsWithinAMillimetreOfTheTruthThorough) {
  const Experiment experiment = ReadConfig<Experiment>(
      kConfigs / "phantom.yaml",
      std::vector<std::string>{"implicit.resolution=70", "template.max_level=2",
                               "uncertainty.sigma=false"});
  const RunResult result = problems::Run(experiment, {});
  ASSERT_TRUE(result.truth);
  EXPECT_LE(result.truth->implicit.truth_to_face.rms_mm, 1.0);
  EXPECT_GE(result.truth->implicit.truth_to_face.area_cm2, 250);
  // The generic face has a nose and lips, the phantom has none.
  EXPECT_LE(result.truth->face.truth_to_face.median_mm, 1.0);
  EXPECT_TRUE(result.usable());
}

TEST(Run, TheThinPlateNearsTheTipsAndThePlacedTemplateStays) {
  const RunResult placed = problems::Run(SmallPhantom({"face=placed"}), {});
  const RunResult bent =
      problems::Run(SmallPhantom({"face={type: thin_plate, stiffness_mm: 0}"}), {});
  EXPECT_EQ(placed.fit.surface.Offsets(), placed.placed.surface.Offsets());
  EXPECT_GT(placed.fit.dowel_rms_mm, 1);
  EXPECT_LT(
      bent.fit.dowel_rms_mm,
      0.5 * placed.fit.dowel_rms_mm);  // the plate has a kink at each tip, which the spline rounds
  EXPECT_TRUE(placed.usable() && bent.usable());
  EXPECT_FALSE(placed.uncertainty);
}

std::string TemplateOfIctFiles() {
  return fmt::format(
      "template={{type: file, surface: {0}head.hspline.json, sites: {0}sites.csv, features: "
      "{0}features.json}}",
      (kConfigs / "faces/ict/").string());
}

// The skull of the reference is the subject's under an affine map. The plate undoes exactly that
// map.
TEST(Run, AReferencesSkinFollowsItsSkullToTheSubjectsThorough) {
  const std::string files = TemplateOfIctFiles();
  const RunResult placed = problems::Run(SmallPhantom({files, "face=placed"}), {});
  const Similarity& face_from_template = placed.face_from_template;
  const auto widened = [](const Vec3& p) { return Vec3(1.1 * p.x() + 0.2 * p.z(), p.y(), p.z()); };
  std::string csv = "site,x,y,z\n";
  for (const auto& [site, point] : placed.subject.points) {
    const Vec3 p = face_from_template.rotation.transpose() *
                   (widened(point) - face_from_template.translation) / face_from_template.scale;
    csv += fmt::format("{},{},{},{}\n", site, p.x(), p.y(), p.z());
  }
  const testing::ScratchFolder folder;
  WriteFileAtomically(folder.Path() / "skull.csv", csv);
  const std::string face =
      fmt::format("face={{type: reference, landmarks: {}/skull.csv}}", folder.Path().string());
  const RunResult carried = problems::Run(SmallPhantom({files, face}), {});
  for (const Vec2& uv : {Vec2(0.5, 0.5), Vec2(0.3, 0.7), Vec2(0.8, 0.2)}) {
    EXPECT_LT((widened(carried.fit.surface.Point(uv)) - placed.fit.surface.Point(uv)).norm(), 0.01);
  }
  // Such a face fits neither the bone nor the markers.
  EXPECT_THAT(carried.Faults(), ::testing::Contains(HasSubstr("cuts into the skull")));

  WriteFileAtomically(folder.Path() / "skull.csv", csv.substr(0, csv.find("\n", 60) + 1));
  EXPECT_THAT(WordsOf<InputError>([&] {
                problems::Run(SmallPhantom({files, face}), {});
              }),
              HasSubstr("landmarks with the subject"));
}

TEST(Run, AReferenceNamesItsLandmarksAndItsSkin) {
  EXPECT_THAT(WordsOf<ConfigError>([] {
                SmallPhantom({TemplateOfIctFiles(), "face=reference"});
              }),
              HasSubstr("face.landmarks: no file is named"));
  EXPECT_THAT(
      WordsOf<ConfigError>([] { SmallPhantom({"face={type: reference, landmarks: skull.csv}"}); }),
      HasSubstr("takes that head's own skin"));
}

// The sites of the skull that lies people's mean depth below the face of the model.
std::string SkullOfMeanPerson() {
  const TemplateFace face = LoadTemplate(IctTemplate{.mean = IctMean::kModel});
  std::string csv = "site,x,y,z\n";
  const auto& people = interp::CarriedPeople().sites;
  for (const auto& [site, uv] : face.site_uv) {
    const SurfaceFrame skin = face.surface.Frame(uv);
    const Vec3 p = skin.point - std::exp(people.at(site).depth.mean) * skin.Normal();
    csv += fmt::format("{},{},{},{}\n", site, p.x(), p.y(), p.z());
  }
  return csv;
}

TEST(Run, WithoutLandmarksTheReferenceIsTheMeanPersonThorough) {
  const testing::ScratchFolder folder;
  WriteFileAtomically(folder.Path() / "skull.csv", SkullOfMeanPerson());
  const RunResult by_file =
      problems::Run(SmallPhantom({TemplateOfIctFiles(),
                                  fmt::format("face={{type: reference, landmarks: {}/skull.csv}}",
                                              folder.Path().string())}),
                    {});
  const RunResult carried =
      problems::Run(SmallPhantom({"template={type: ict, mean: model}", "face=reference"}), {});
  for (const Vec2& uv : {Vec2(0.5, 0.5), Vec2(0.3, 0.7), Vec2(0.8, 0.2)}) {
    EXPECT_LT((carried.fit.surface.Point(uv) - by_file.fit.surface.Point(uv)).norm(), 1e-3);
  }
}

TEST(Run, AScoreOverASmallPartOfTheFaceIsNoted) {
  const std::string small = "region.exclude=[{site: n, radius_mm: 105}]";
  const auto notes = [](const std::vector<std::string>& more) {
    std::vector<std::string> overrides = {"face=placed"};
    overrides.insert(overrides.end(), more.begin(), more.end());
    return problems::Run(SmallPhantom(overrides), {}).subject.notes;
  };
  const auto note = ::testing::Contains(HasSubstr("says little about the face"));
  EXPECT_THAT(notes({}), ::testing::Not(note));
  EXPECT_THAT(notes({small}), note);
}

Experiment PhantomWithPrior(const std::vector<std::string>& more) {
  const std::string ict = (kConfigs / "faces/ict/").string();
  std::vector<std::string> overrides = {
      TemplateOfIctFiles(),
      fmt::format("prior={{type: hspline, modes: {}modes.json, count: 20}}", ict), "face=prior"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  return SmallPhantom(overrides);
}

TEST(Run, ThePriorsFaceIsNearTheTipsAndSaysHowSureItIsThorough) {
  const Experiment experiment = PhantomWithPrior({});
  const RunResult result = problems::Run(experiment, {});
  ASSERT_TRUE(result.prior && result.uncertainty);
  EXPECT_TRUE(result.usable());
  EXPECT_EQ(result.prior->coefficients.size(), 20);
  EXPECT_GE(result.uncertainty->median_mm, 1.25);  // the discrepancy at least
  for (const double off : result.prior->tip_residual_mm) {
    EXPECT_LT(std::abs(off), 6);
  }
  const auto json = ResultJson(experiment, result);
  EXPECT_THAT(json.dump(), HasSubstr("coefficients_rms"));
  EXPECT_EQ(json.at("method").at("face"), "prior");
}

// At a site that the prior lacks, the (u,v) is that of the point of the face nearest to the tip.
TEST(Run, APriorsFaceIsMeasuredWhereItMeetsTheDowels) {
  const std::string mine = "sites={mine: {near: [im_l, lo_l], depth: 12}}";
  const RunResult result = problems::Run(PhantomWithPrior({mine}), {});
  const auto at = std::ranges::find(result.target.points, "mine", &FitPoint::label);
  ASSERT_NE(at, result.target.points.end());
  const double nearest_mm = MeshQuery(result.face.mesh).Closest(at->position).distance_mm;
  EXPECT_NEAR(result.fit.residual_mm[at - result.target.points.begin()], nearest_mm, 0.1);
  EXPECT_THAT(WordsOf<InputError>(
                  [] { problems::Run(PhantomWithPrior({"sites={g: {uv: [0.3, 0.3]}}"}), {}); }),
              HasSubstr("sites.g.uv: `face: prior` has its own place for the landmark g"));
}

TEST(Run, EditsChangeTheFacesDrawnBesideAsTheDrawItselfThorough) {
  const ScratchFolder folder;
  WriteFileAtomically(folder / "mine.yaml", "edits: [{level: 0, i: 3, j: 3, offset: [0, 0, 6]}]\n");
  const std::string edits = "edits=" + (folder / "mine.yaml").string();
  StageCache cache(8);
  const auto run = [&](const std::vector<std::string>& more) {
    return problems::Run(PhantomWithPrior(more), {}, &cache);
  };
  const RunResult plain = run({"uncertainty.samples=1"}),
                  edited = run({"uncertainty.samples=1", edits}),
                  drawn = run({"face.draw=1", edits});
  const HSplineSurface& sample = edited.uncertainty->samples[0];
  EXPECT_EQ(sample.Offsets(), drawn.fit.surface.Offsets());
  EXPECT_EQ(sample.Net(0).vertices, drawn.fit.surface.Net(0).vertices);
  EXPECT_NE(sample.Net(0).vertices, plain.uncertainty->samples[0].Net(0).vertices);
}

TEST(Run, ASampleIsTheFaceOfTheDrawOfItsNumber) {
  StageCache cache(8);
  const RunResult likely = problems::Run(
      PhantomWithPrior({"uncertainty.samples=2", "uncertainty.random_seed=3"}), {}, &cache);
  const RunResult drawn = problems::Run(PhantomWithPrior({"face.draw=4"}), {}, &cache);
  ASSERT_EQ(likely.uncertainty->samples.size(), 2u);
  EXPECT_EQ(likely.uncertainty->samples[1].Offsets(), drawn.fit.surface.Offsets());
  EXPECT_NE(likely.fit.surface.Offsets(), drawn.fit.surface.Offsets());
  EXPECT_EQ(likely.uncertainty->sigma_mm, drawn.uncertainty->sigma_mm);
  EXPECT_THAT(drawn.subject.notes, ::testing::Contains(HasSubstr("number 4 of those drawn")));
}

TEST(Run, AFaceOfAPriorNeedsOne) {
  EXPECT_THAT([] { SmallPhantom({"face=prior"}); },
              ::testing::ThrowsMessage<ConfigError>(HasSubstr("which fits `template: ict` alone")));
  EXPECT_THAT(
      [] {
        SmallPhantom({"face=prior", "prior=none"});
      },
      ::testing::ThrowsMessage<ConfigError>(HasSubstr("name one under `prior`")));
}

// The largest angle between the normals of two triangles that share an edge; 180 is a fold.
double SharpestEdge_deg(const TriMesh& mesh) {
  std::map<std::array<int, 2>, Vec3> normals;  // of the first triangle at an edge
  double cosine = 1;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 normal = TriangleAreaVector(mesh, t).normalized();
    for (int k = 0; k < 3; ++k) {
      const std::array<int, 2> edge = {std::min(t[k], t[(k + 1) % 3]),
                                       std::max(t[k], t[(k + 1) % 3])};
      const auto [other, first] = normals.try_emplace(edge, normal);
      cosine = first ? cosine : std::min(cosine, normal.dot(other->second));
    }
  }
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

TEST(Run, TheFaceIsASheetWithoutFoldsThatFacesOut) {
  const RunResult result = problems::Run(SmallPhantom({"uncertainty.sigma=false"}), {});
  const TriMesh& face = result.face.mesh;
  const EdgeReport edges = CheckEdges(face);
  EXPECT_EQ(edges.non_manifold, 0);
  EXPECT_EQ(edges.inconsistent, 0);
  EXPECT_EQ(ConnectedComponents(face).count, 1);
  EXPECT_LT(SharpestEdge_deg(face), 60);
  // Normals point away from the middle of the head, so no triangle on the dowels' side is turned
  // over.
  const Vec3 middle = Bounds(result.subject.skull).center();
  int turned = 0;
  for (const Triangle& t : face.triangles) {
    turned += TriangleAreaVector(face, t).dot(TriangleCentroid(face, t) - middle) < 0 ? 1 : 0;
  }
  EXPECT_EQ(turned, 0);
}

// Level 0 alone, with one more term.
RunResult RunWithTerm(const std::string& term, StageCache& cache) {
  return problems::Run(
      SmallPhantom({fmt::format("fit.terms=[points, smoothness, membrane{}]", term),
                    "template.max_level=1", "fit.plan.schedule=[{level: 0, fraction: 1}]",
                    "fit.relaxation=none", "uncertainty.sigma=false"}),
      {}, &cache);
}

// Mean distance of the face from the shell of the skull, at the (u,v) of the points.
double MeanHeight_mm(const RunResult& result) {
  const MeshQuery shell(result.shell);
  double sum = 0;
  for (const FitPoint& p : result.target.points) {
    sum += shell.Closest(result.fit.surface.Point(p.uv)).distance_mm;
  }
  return sum / static_cast<double>(result.target.points.size());
}

// Root mean square of the springs' elongation between the points and their anchors.
double SpringRms_mm(const RunResult& result) {
  double sum = 0, weights = 0;
  for (std::size_t k = 0; k < result.target.points.size(); ++k) {
    const FitPoint& p = result.target.points[k];
    const Vec3& foot = result.target.anchors[k].foot;
    if (foot.allFinite()) {
      const double longer =
          (result.fit.surface.Point(p.uv) - foot).norm() - (p.position - foot).norm();
      sum += p.weight * longer * longer;
      weights += p.weight;
    }
  }
  return std::sqrt(sum / weights);
}

double Strain(const RunResult& result) {
  return MeasureDistortion(result.fit.surface, result.placed.surface,
                           [](const Vec3&) { return true; })
      .rms_strain;
}

TEST(Run, ATermIsObeyedTheMoreItWeighsThorough) {
  StageCache cache(16);
  const auto run = [&](const std::string& term) { return RunWithTerm(term, cache); };
  // It does nothing here, but seeds have anchors.
  const RunResult idle = run(", {type: non_penetration, min_depth_mm: 0}");
  const double height_mm = MeanHeight_mm(idle);
  EXPECT_NEAR(MeanHeight_mm(run("")), height_mm, 0.1);
  EXPECT_GT(MeanHeight_mm(run(", {type: non_penetration, weight: 10, min_depth_mm: 25}")),
            height_mm + 5);
  EXPECT_LT(SpringRms_mm(run(", {type: spring, weight: 100}")), SpringRms_mm(idle));
  const double little = Strain(run(", {type: distortion, weight: 1}")),
               much = Strain(run(", {type: distortion, weight: 100}"));
  EXPECT_LT(little, 0.6 * Strain(idle));
  EXPECT_LT(much, 0.6 * little);
}

// The number of feature offsets that equal the template's after a run.
int KeptFeatures(const RunResult& result) {
  int kept = 0;
  for (const VertexId& vertex : FeatureVertices(result.placed)) {
    kept += result.fit.surface.Offset(vertex) == result.placed.surface.Offset(vertex) ? 1 : 0;
  }
  return kept;
}

// Studies measure whether a rule protects the features. This test checks that a run obeys and
// reports it.
TEST(Run, SaysWhatItDidToTheFeatures) {
  StageCache cache(16);
  for (const std::string rule : {"frozen", "free"}) {
    const RunResult result = problems::Run(
        SmallPhantom({fmt::format("fit.features={}", rule), "uncertainty.sigma=false"}), {},
        &cache);
    const int features = static_cast<int>(FeatureVertices(result.placed).size());
    if (rule == "frozen") {
      EXPECT_EQ(KeptFeatures(result), features);
    } else {
      EXPECT_LT(KeptFeatures(result), features);
    }
    EXPECT_EQ(result.fit.restored_features, rule == "frozen" ? features : 0);
    EXPECT_EQ(result.features.back().part, "elsewhere");
    const FeatureDistortion& all = *(result.features.end() - 2);
    EXPECT_EQ(all.part, "features");
    EXPECT_GT(all.distortion.rms_strain, 0);
    EXPECT_GT(all.distortion.max_strain, all.distortion.rms_strain);
  }
}

TEST(Run, ATemplateFromAFileGivesTheSameFaceToTheBitThorough) {
  const ScratchFolder folder;
  const Experiment formula = SmallPhantom();
  const FileTemplate files = WriteTemplate(folder.Path(), LoadTemplate(formula.face_template));
  const Experiment from_file = SmallPhantom(
      {fmt::format("template={{type: file, surface: {}, sites: {}, features: {}}}",
                   files.surface.string(), files.sites.string(), files.features.string())});
  StageCache cache(16);
  const RunResult first = problems::Run(formula, {}, &cache),
                  second = problems::Run(from_file, {}, &cache);
  EXPECT_EQ(ResultJson(formula, first).dump(), ResultJson(from_file, second).dump());
  EXPECT_EQ(ResultJson(formula, first).at("method").dump(),
            R"({"face":"fit","interp":"barycentric"})");  // the first is `auto` in the file
  EXPECT_EQ(HSplineToJson(first.fit.surface), HSplineToJson(second.fit.surface));
  EXPECT_EQ(first.face.mesh.points, second.face.mesh.points);
  EXPECT_EQ(first.uncertainty->median_mm, second.uncertainty->median_mm);
  EXPECT_THAT(InputFiles(from_file),
              ::testing::IsSupersetOf({files.surface, files.sites, files.features}));
}

TEST(Run, ATemplateThatIsNotThereIsOneClearError) {
  EXPECT_THAT(WordsOf<ConfigError>([] { SmallPhantom({"template=file"}); }),
              HasSubstr("template.surface: no file is named"));
  Experiment experiment = SmallPhantom({});
  experiment.face_template = FileTemplate{"/no/head.hspline.json", "/no/sites.csv", {}};
  EXPECT_THROW(problems::Run(experiment, {}), IoError);
}

// A phantom in files. Only its left cheek is missing.
Experiment WithoutCheek(const fs::path& folder) {
  const Phantom phantom = MakePhantom({.random_seed = 2, .rings = 30});
  const Vec3 cheek =
      std::ranges::find(phantom.sites, std::string("im_l"), &PhantomSite::site)->base;
  std::vector<bool> keep;
  for (const Triangle& t : phantom.skull.triangles) {
    keep.push_back((TriangleCentroid(phantom.skull, t) - cheek).norm() > 35);
  }
  LandmarkFile landmarks;
  landmarks.subject = "P";
  for (const PhantomSite& s : phantom.sites) {
    if ((s.base - cheek).norm() > 36) {
      Landmark& landmark = landmarks.landmarks.emplace_back();
      landmark.site = s.site;
      landmark.point = {s.base.x(), s.base.y(), s.base.z()};
    }
  }
  WriteFileAtomically(folder / "skull.ply", EncodeMesh(Submesh(phantom.skull, keep), ".ply"));
  WriteFileAtomically(folder / "landmarks.yaml", EncodeLandmarks(landmarks, "landmarks.yaml"));
  return SmallPhantom({fmt::format("subject={{type: files, skull: {0}/skull.ply, landmarks: "
                                   "{0}/landmarks.yaml, mirror: {{missing: true}}}}",
                                   folder.string()),
                       "tissue={depths: table, table: " +
                           (kConfigs / "tables/rhine_caucasoid.yaml").string() + "}"});
}

TEST(Run, MirroredBoneIsToldDrawnAndKeptToTheFaceThorough) {
  const ScratchFolder folder;
  const auto files = FilesOfRun(WithoutCheek(folder.Path()), folder / "run", 2);
  const auto result = nlohmann::json::parse(files.at("result.json"));
  EXPECT_GT(result.at("bone").at("mirrored_cm2"), 15);
  EXPECT_GT(result.at("bone").at("observed_cm2"), 800);
  EXPECT_THAT(result.at("notes").dump(), HasSubstr("the left side lacks"));
  EXPECT_THAT(result.at("notes").dump(), HasSubstr("im_l"));
  EXPECT_THAT(files.at("report.html"), HasSubstr("Observed and invented bone"));
  const auto layers = nlohmann::json::parse(files.at("scene.json")).at("layers");
  const auto origin =
      std::ranges::find_if(layers, [](const auto& l) { return l["id"] == "origin"; });
  ASSERT_NE(origin, layers.end());
  EXPECT_GE(origin->at("parts").size(), 1u);  // mirrored bone in its own colour
  for (const char* mesh : {"face.ply", "implicit.ply", "depth.ply"}) {
    EXPECT_THAT(files.at(mesh).substr(0, 1000), HasSubstr("scalar_origin")) << mesh;
  }
}

void ExpectWhatARunLeaves(const std::map<std::string, std::string>& files) {
  std::vector<std::string> names;
  for (const auto& [name, bytes] : files) {
    names.push_back(name);
    EXPECT_TRUE(IsAmong(kRunFiles, name)) << name;
  }
  EXPECT_THAT(names, UnorderedElementsAreArray({"depth.ply",
                                                "dowels.csv",
                                                "face.hspline.json",
                                                "face.ply",
                                                "implicit.ply",
                                                "manifest.json",
                                                "provenance.json",
                                                "scene.json",
                                                "pictures/error.png",
                                                "pictures/face.png",
                                                "pictures/fit.png",
                                                "pictures/face_over_skull.png",
                                                "pictures/implicit.png",
                                                "pictures/overview.png",
                                                "pictures/scored.png",
                                                "pictures/section_axial_mp.svg",
                                                "pictures/section_axial_n.svg",
                                                "pictures/section_coronal_zy.svg",
                                                "pictures/section_sagittal_n.svg",
                                                "pictures/sigma.png",
                                                "pictures/skull_dowels.png",
                                                "pictures/truth.png",
                                                "report.html",
                                                "resolved.yaml",
                                                "result.json",
                                                "seeds.csv"}));
  const auto manifest = nlohmann::json::parse(files.at("manifest.json"));
  EXPECT_EQ(manifest.at("outputs").size(), files.size() - 1);
  EXPECT_EQ(manifest.at("random_seed"), 1);
  const auto result = nlohmann::json::parse(files.at("result.json"));
  for (const char* metric : {"mean_abs_mm", "rms_mm", "median_mm", "p95_mm", "hausdorff_mm",
                             "within_2_5mm", "volume_between_cm3", "regions"}) {
    EXPECT_TRUE(result.at("face").contains(metric)) << metric;
  }
  EXPECT_TRUE(result.at("fit").contains("dowel_rms_mm"));
  EXPECT_EQ(result.at("fit").at("levels").size(), 6u);
  EXPECT_THAT(files.at("face.ply"), HasSubstr("property uchar red"));
  EXPECT_THAT(files.at("face.ply"), HasSubstr("quality"));
  EXPECT_THAT(files.at("face.ply"), HasSubstr("scalar_error_mm"));
}

void ExpectReportBuiltAnew(const fs::path& folder, const std::string& report) {
  fs::remove(folder / "report.html");
  OutputFolder output(folder, WhenNotEmpty::kReplaceFiles);
  WriteReport(output);
  EXPECT_EQ(ReadFileBytes(folder / "report.html"), report);
}

// This is a single test, because each of its runs makes all pictures.
TEST(Run, TheFolderHoldsWhatItsManifestListsInTheSameBytesForAnyNumberOfThreads) {
  const ScratchFolder folder;
  const auto one = FilesOfRun(SmallPhantom(), folder / "one", 1);
  ExpectWhatARunLeaves(one);
  ExpectReportBuiltAnew(folder / "one", one.at("report.html"));
  const auto resolved = ReadConfig<Experiment>(folder / "one" / "resolved.yaml", {});
  EXPECT_EQ(FilesOfRun(resolved, folder / "again", 2), one);
}

bool IsOfReport(const std::string& name) {
  return name == "report.html" || name == "scene.json" || name.starts_with("pictures/");
}

TEST(Run, WithoutAReportTheOtherFilesAreTheSameThorough) {
  const ScratchFolder folder;
  const RunResult result = problems::Run(SmallPhantom(), {});
  std::map<bool, std::map<std::string, std::string>> files;
  for (const bool report : {true, false}) {
    OutputFolder output(folder / (report ? "with" : "without"), WhenNotEmpty::kRefuse);
    WriteRun(SmallPhantom({fmt::format("report={}", report)}), result, output, {});
    files[report] = FilesOf(output.Root());
    for (const char* name : {"timing.json", "manifest.json", "resolved.yaml"}) {
      EXPECT_EQ(files[report].erase(name), 1u) << name;  // the option is a line of resolved.yaml
    }
  }
  EXPECT_GT(std::erase_if(files[true], [](const auto& file) { return IsOfReport(file.first); }), 9);
  EXPECT_EQ(files[false], files[true]);
  OutputFolder without(folder / "without", WhenNotEmpty::kReplaceFiles);
  EXPECT_THAT(WordsOf<IoError>([&] { WriteReport(without); }), HasSubstr("it has no pictures"));
}

TEST(Run, ASkullWithoutLandmarksIsOneClearError) {
  const ScratchFolder folder;
  std::ofstream(folder / "e.yaml")
      << "subject: {type: files, skull: a.ply}\n"
      << "network: " << (kConfigs / "networks/standard32.yaml") << "\n";
  EXPECT_EQ(WordsOf<InputError>(
                [&] { problems::Run(ReadConfig<Experiment>(folder / "e.yaml", {}), {}); }),
            "subject.landmarks: no file is named; a skull needs landmarks (configs/landmarks/ "
            "shows the form)");
}

TEST(Run, ARegionWithoutSkinIsToldBeforeTheFit) {
  std::vector<std::string> steps;
  RunContext context;
  context.on_event = [&steps](const Event& event) { steps.push_back(event.step); };
  const Experiment all_excluded = SmallPhantom({"region.exclude=[{site: n, radius_mm: 200}]"});
  EXPECT_THAT(WordsOf<InputError>([&] { problems::Run(all_excluded, context); }),
              HasSubstr("no vertex of the true skin is scored"));
  EXPECT_THAT(steps, ::testing::Contains("polygonize"));
  EXPECT_THAT(steps, ::testing::Not(::testing::Contains("fit")));
}

TEST(Run, CanBeStopped) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop_token = source.get_token();
  EXPECT_THROW(problems::Run(SmallPhantom(), context), Cancelled);
}

}  // namespace
}  // namespace semblance::problems
