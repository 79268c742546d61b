// SPDX-License-Identifier: GPL-3.0-or-later
// Depth without a fit: against the phantom's known depth, with dowels left out, and as a study.
#include "problems/study/depth_study.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "problems/experiment/experiment_config.h"
#include "problems/study/report/study_report.h"
#include "problems/study/report/study_sections.h"
#include "problems/study/study_run.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using testing::ScratchFolder;
using Json = nlohmann::ordered_json;

Experiment SmallPhantom(std::vector<std::string> overrides = {}) {
  overrides.insert(overrides.begin(), "subject.rings=50");
  return ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
}

DepthResult Measured(std::vector<std::string> overrides = {}) {
  return MeasureDepth(SmallPhantom(std::move(overrides)), {});
}

TEST(DepthStudy, TheTruthIsThePhantomsOwnDepth) {
  const DepthResult result = Measured();
  const Phantom phantom = MakePhantom({.random_seed = 1, .rings = 50});
  ASSERT_TRUE(result.truth);
  const TruthMap& along = result.truth->truth.along_direction;
  double squares = 0;
  int count = 0;
  for (std::size_t v = 0; v < phantom.depth_mm.size(); ++v) {
    if (result.truth->region.scored[v] && along.status[v] == TruthStatus::kValid) {
      squares += std::pow(along.depth_mm[v] - phantom.depth_mm[v], 2);
      ++count;
      EXPECT_LE(result.truth->truth.closest.depth_mm[v], along.depth_mm[v] + 1e-9);
    }
  }
  EXPECT_GT(count, 500);
  EXPECT_LT(std::sqrt(squares / count), 0.25);  // the mesh's normals are not the exact ones
}

// The compared bone is the same with fewer dowels, moved dowels, and further dowels inside and
// outside the network.
TEST(DepthStudy, TheComparedBoneDependsOnAllLandmarksAlone) {
  const std::vector<bool> all = Measured().truth->region.scored;
  const std::vector<Vec3> bone = MakePhantom({.random_seed = 1, .rings = 50}).skull.points;
  const Vec3 crown = *std::ranges::max_element(bone, {}, [](const Vec3& p) { return p.z(); });
  for (const std::string& change :
       {std::string("landmarks.keep={type: spread, n: 8}"), std::string("landmarks.noise_mm=2"),
        std::string("sites={inside: {near: [g, mso_l], depth: 5}}"),
        fmt::format("sites={{outside: {{near: [{}, {}, {}], depth: 5}}}}", crown.x(), crown.y(),
                    crown.z())}) {
    EXPECT_EQ(Measured({change}).truth->region.scored, all) << change;
  }
}

TEST(DepthStudy, AMapOfTheTrueDepthHasOnlyTheErrorOfTheNormals) {
  const ScratchFolder folder;
  const Phantom phantom = MakePhantom({.random_seed = 1, .rings = 50});
  WriteFileAtomically(
      folder / "true.ply",
      EncodeMesh(
          phantom.skull, ".ply",
          {.normals = {}, .colors = {}, .scalars = {{"scalar_depth_mm", phantom.depth_mm}}}));
  const DepthResult map = Measured(
      {fmt::format("interp={{type: depth_map, file: {}}}", (folder / "true.ply").string())});
  EXPECT_TRUE(map.left_out.empty());
  const double best = map.truth->along_direction.all.rms_mm;
  EXPECT_LT(best, 0.25);
  for (const char* scheme : {"barycentric", "network_spline", "mean"}) {
    EXPECT_GT(Measured({fmt::format("interp={}", scheme)}).truth->along_direction.all.rms_mm, best);
  }
}

TEST(DepthStudy, ErrorsAreInterpolatedMinusTrueDepth) {
  const DepthResult result = Measured({"interp=mean"});
  const DepthComparison& truth = *result.truth;
  const double mean = result.stage->depth.depth_mm[0];
  for (std::size_t v = 0; v < truth.truth.closest.depth_mm.size(); ++v) {
    if (std::isfinite(truth.closest.error_mm[v])) {
      ASSERT_NEAR(truth.closest.error_mm[v], mean - truth.truth.closest.depth_mm[v], 1e-12);
    }
  }
  EXPECT_LT(truth.tips.rms_mm, truth.along_direction.all.rms_mm);  // tips go to the closest skin
  // The mean states no sd. It is learned from left-out landmarks, for all vertices with a depth.
  EXPECT_EQ(truth.along_direction.scores.stated, truth.along_direction.scores.points);
  EXPECT_NEAR(truth.along_direction.scores.rmse_mm, truth.along_direction.all.rms_mm, 1e-9);
  EXPECT_NEAR(truth.along_direction.scores.bias_mm, truth.along_direction.all.mean_signed_mm, 1e-9);
  double area = 0;
  for (const auto& [name, part] : truth.along_direction.regions) {
    area += part.area_cm2;
  }
  EXPECT_NEAR(area, truth.along_direction.all.area_cm2, 1e-9);
}

TEST(DepthStudy, MostErrorsLieWithinTheSdOfKriging) {
  const DepthResult result = Measured({"interp=kriging"});
  EXPECT_GT(result.truth->along_direction.coverage_90, 0.6);
  EXPECT_LE(result.truth->along_direction.coverage_90, 1);
}

// The 90 % interval of every scheme, stated or learned, contains most true depths.
TEST(DepthStudy, TheIntervalsOfEverySchemeHoldMostDepthsThorough) {
  for (const char* scheme : {"auto", "barycentric", "natural_neighbour", "biharmonic"}) {
    const double within =
        Measured({fmt::format("interp={}", scheme)}).truth->along_direction.scores.coverage_90;
    EXPECT_GT(within, 0.78) << scheme;
    EXPECT_LE(within, 1) << scheme;
  }
}

// Without one side the network covers only the other; the scheme has almost no value on the first.
TEST(DepthStudy, ALeftOutSideIsPredictedByTheOutsideRule) {
  const DepthResult result = Measured({"interp=barycentric"});
  const CrossValidation& side = result.left_out[1].second;
  EXPECT_EQ(side.scores_with_rule.points, 22);
  EXPECT_LT(side.scores.points, 5);
  const CrossValidation everywhere = Measured({"interp=kriging"}).left_out[1].second;
  EXPECT_GT(everywhere.scores.points, 10);
}

TEST(DepthStudy, AutoReportsItsWeights) {
  const Experiment experiment = SmallPhantom({"interp=auto"});
  const DepthResult result = MeasureDepth(experiment, {});
  const Json shares = DepthResultJson(experiment, result).at("depth").at("shares");
  double sum = 0;
  for (const auto& [scheme, weight] : shares.items()) {
    sum += weight.get<double>();
  }
  EXPECT_NEAR(sum, 1, 1e-9);
  EXPECT_THAT(DepthText(result), HasSubstr("weights: radial_basis 0."));
}

// No ray to the skin is shorter than the distance to the closest skin, and rays of two directions
// almost never have the same length.
TEST(DepthStudy, TheDirectionChangesTheEndsAndTheTruthAlongIt) {
  const DepthComparison normal = *Measured().truth;
  for (const std::string direction :
       {"dowel_direction", "{type: smoothed_normal, radius_mm: 15}"}) {
    const DepthComparison turned = *Measured({"direction=" + direction}).truth;
    int both = 0, other = 0;
    for (std::size_t v = 0; v < turned.truth.along_direction.depth_mm.size(); ++v) {
      if (turned.region.scored[v] &&
          turned.truth.along_direction.status[v] == TruthStatus::kValid &&
          normal.truth.along_direction.status[v] == TruthStatus::kValid) {
        const double depth = turned.truth.along_direction.depth_mm[v];
        ASSERT_GE(depth, turned.truth.closest.depth_mm[v] - 1e-9) << direction;
        ++both;
        other += std::abs(depth - normal.truth.along_direction.depth_mm[v]) > 1e-3 ? 1 : 0;
      }
    }
    EXPECT_GT(both, 500) << direction;
    EXPECT_GT(other, 0.9 * both) << direction;
    EXPECT_GT(std::abs(turned.tips.rms_mm - normal.tips.rms_mm), 1e-6) << direction;
  }
}

TEST(DepthStudy, LeavesOutLandmarksSidesAndParts) {
  const DepthResult result = Measured();
  ASSERT_EQ(result.left_out.size(), 3u);
  EXPECT_EQ(result.left_out[0].first, "landmark");
  EXPECT_EQ(result.left_out[1].first, "side");
  EXPECT_EQ(result.left_out[2].first, "k_fold");
  EXPECT_EQ(result.left_out[0].second.left_out.size(), 32u);
  EXPECT_EQ(result.left_out[1].second.left_out.size(), 22u);
  EXPECT_EQ(result.left_out[2].second.left_out.size(), 32u);
  const std::string csv = LeftOutCsv(result);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 32 + 22 + 32);
  EXPECT_THAT(csv, HasSubstr("\nlandmark,go_l,go,jaw,"));
}

TEST(DepthStudy, JsonHasEveryNumberByItsPath) {
  const Experiment experiment = SmallPhantom({"interp=kriging"});
  const DepthResult result = MeasureDepth(experiment, {});
  const Json json = DepthResultJson(experiment, result);
  EXPECT_EQ(json.at("usable"), true);
  for (const char* path :
       {"/depth/assigned", "/depth_truth/along_direction/rms_mm", "/depth_truth/closest/p95_mm",
        "/depth_truth/along_direction/regions/cheeks/rms_mm",
        "/depth_truth/along_direction/vertices/valid", "/depth_truth/along_direction/coverage_90",
        "/depth_truth/tips/mean_abs_mm", "/cross_validation/landmark/sites/go_l",
        "/cross_validation/side/rms_mm", "/cross_validation/k_fold/regions/nose/rms_mm",
        "/cross_validation/landmark/coverage_90", "/depth_truth/along_direction/scores/all/crps_mm",
        "/depth_truth/along_direction/scores/scheme/interval_score_90_mm",
        "/depth_truth/along_direction/regions/cheeks/scores/log_score",
        "/depth_truth/along_direction/scores/all/pit/9",
        "/cross_validation/landmark/scores/scheme/crps_mm",
        "/cross_validation/side/scores/scheme/n"}) {
    EXPECT_TRUE(json.at(Json::json_pointer(path)).is_number()) << path;
  }
}

TEST(DepthStudy, TheFolderHoldsMeshesWithTheirNumbers) {
  const ScratchFolder folder;
  const Experiment experiment = SmallPhantom();
  const DepthResult result = MeasureDepth(experiment, {});
  OutputFolder output(folder / "out", WhenNotEmpty::kRefuse);
  WriteDepth(experiment, result, output, {});
  EXPECT_THAT(output.Written(), ElementsAreArray(kDepthFiles));
  // depth.ply is itself a map that can be read back.
  const DepthResult again = Measured({fmt::format("interp={{type: depth_map, file: {}}}",
                                                  (folder / "out" / "depth.ply").string())});
  for (std::size_t v = 0; v < result.stage->depth.depth_mm.size(); ++v) {
    if (std::isfinite(result.stage->depth.depth_mm[v])) {
      ASSERT_NEAR(again.stage->depth.depth_mm[v], result.stage->depth.depth_mm[v], 1e-5);
    }
  }
  EXPECT_EQ(ReadMesh(folder / "out" / "tips.ply").points.size(),
            ReadMesh(folder / "out" / "depth.ply").points.size());
}

TEST(DepthStudy, AStudyRanksHasSubtablesAndShowsTheFirstSubjectsMaps) {
  const ScratchFolder folder;
  WriteFileAtomically(folder / "study.yaml",
                      fmt::format("base: {}/configs/phantom.yaml\nset: {{subject.rings: 40}}\n"
                                  "job: depth\nkeep: view\nsubjects:\n"
                                  "  - {{name: a, set: {{subject.random_seed: 1}}}}\n"
                                  "  - {{name: b, set: {{subject.random_seed: 2}}}}\n"
                                  "grid: {{interp: [mean, network_spline]}}\n"
                                  "metric: depth_truth.along_direction.rms_mm\n",
                                  SEMBLANCE_SOURCE_DIR));
  const StudyPlan plan = ReadStudy(folder / "study.yaml");
  RunStudy(plan, folder / "out", {.jobs = 2}, {});
  OutputFolder output(folder / "out", WhenNotEmpty::kReplaceFiles);
  const StudyResults results = WriteStudyTables(output);
  ASSERT_EQ(results.Count("done"), 4);
  const auto treatments = Treatments(results, results.metric);
  ASSERT_EQ(treatments.size(), 2u);
  const auto tables = Subtables(results, treatments);
  ASSERT_EQ(tables.size(), 8u);
  EXPECT_THAT(tables[0].header, Contains("p95 (mm)"));
  EXPECT_THAT(tables[1].header, Contains("cheeks"));
  EXPECT_THAT(tables[2].header, Contains("a side: RMS (mm)"));
  EXPECT_EQ(tables[3].rows.size(), 32u);
  EXPECT_EQ(tables[3].header.size(), 3u);
  // The mean of the two subjects' own numbers.
  const auto& rms = treatments[1].by_subject;
  EXPECT_EQ(tables[0].rows[1][1], fmt::format("{:.3f}", (rms.at("a") + rms.at("b")) / 2));
  EXPECT_THAT(tables[4].header, Contains("CRPS (mm)"));
  EXPECT_THAT(tables[5].caption, HasSubstr("where the scheme itself predicts"));
  EXPECT_THAT(tables[7].caption, HasSubstr("paired by subject"));
  EXPECT_THAT(tables[7].rows[0][1], ::testing::StartsWith("0.000 (0 of 2)"));
  int maps = 0;
  for (const StudyTrial& trial : plan.trials) {
    const bool is_there = fs::exists(folder / "out" / "trials" / trial.id / "depth.png");
    EXPECT_EQ(is_there, trial.subject == "a");
    maps += is_there;
  }
  EXPECT_EQ(maps, 2);
  EXPECT_THAT(ReadFileBytes(folder / "out" / "report.html"), HasSubstr("Depth maps"));
}

TEST(DepthStudy, ReportsAnUnknownJob) {
  const ScratchFolder folder;
  WriteFileAtomically(folder / "study.yaml",
                      fmt::format("base: {}/configs/phantom.yaml\njob: depths\n"
                                  "grid: {{interp: [mean]}}\n",
                                  SEMBLANCE_SOURCE_DIR));
  EXPECT_THAT(testing::WordsOf<ConfigError>([&] { ReadStudy(folder / "study.yaml"); }),
              HasSubstr("depths"));
}

}  // namespace
}  // namespace semblance::problems
