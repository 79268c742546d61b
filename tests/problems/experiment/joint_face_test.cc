// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/joint_face.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "problems/experiment/experiment_config.h"
#include "problems/run.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kFaces = SEMBLANCE_SOURCE_DIR "/configs/faces/ict/";

// A coarse phantom, and a prior with few modes and centres.
Experiment SmallPhantom(const std::string& face, std::vector<std::string> more = {}) {
  const std::string small = "estimate: {field: {centres: 30}}";
  std::vector<std::string> overrides = {
      "subject.rings=24",
      "implicit.resolution=24",
      "uncertainty.sigma=false",
      fmt::format("template={{type: file, surface: {0}head.hspline.json, sites: {0}sites.csv, "
                  "features: {0}features.json}}",
                  kFaces),
      fmt::format("prior={{type: hspline, modes: {}modes.json, count: 20}}", kFaces),
      fmt::format("face={{type: {}, {}}}", face, small)};
  overrides.insert(overrides.end(), more.begin(), more.end());
  return ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
}

// The skull's stages are the same for all.
RunResult RunSmall(const std::string& face, std::vector<std::string> more = {}, int threads = 1) {
  static StageCache cache(8);
  RunContext context;
  context.threads = threads;
  return problems::Run(SmallPhantom(face, std::move(more)), context, &cache);
}

const RunResult& PlainRun(const std::string& face) {
  static std::map<std::string, RunResult> runs;
  const auto found = runs.find(face);
  return found != runs.end() ? found->second : runs.emplace(face, RunSmall(face)).first->second;
}

std::vector<std::string> TermsOf(const LevelSummary& level) {
  std::vector<std::string> terms;
  for (const TermCosts& term : level.terms) {
    terms.push_back(term.term);
  }
  return terms;
}

double CostOf(const LevelSummary& level, double TermCosts::*cost) {
  double sum = 0;
  for (const TermCosts& term : level.terms) {
    sum += term.*cost;
  }
  return sum;
}

double ClosestRms_mm(const RunResult& result) {
  const MeshQuery query(result.face.mesh);
  double sum = 0;
  for (const Dowel& dowel : result.subject.dowels_on_bone) {
    sum += std::pow(query.Closest(dowel.Tip()).distance_mm, 2);
  }
  return std::sqrt(sum / static_cast<double>(result.subject.dowels_on_bone.size()));
}

TEST(JointFace, EveryStepOfTheScheduleIsOneProblemThatLowersItsCost) {
  const RunResult prior = RunSmall("prior");
  const RunResult& joint = PlainRun("joint");
  ASSERT_TRUE(joint.usable());
  ASSERT_EQ(joint.fit.levels.size(), PublishedSchedule().size());
  EXPECT_EQ(joint.fit.relaxations.size(), joint.fit.levels.size());
  for (std::size_t k = 0; k < joint.fit.levels.size(); ++k) {
    const LevelSummary& level = joint.fit.levels[k];
    EXPECT_EQ(level.level, PublishedSchedule()[k].level);
    EXPECT_EQ(level.fraction, PublishedSchedule()[k].fraction);
    EXPECT_EQ(level.solver, "ceres");
    EXPECT_EQ(level.termination, "CONVERGENCE");
    EXPECT_GT(level.moved_vertices, 0);
    EXPECT_THAT(TermsOf(level), Contains("seeds"));
    EXPECT_LT(CostOf(level, &TermCosts::after), CostOf(level, &TermCosts::before));
  }
  EXPECT_GT(joint.seeding.points.size(), 50u);
  EXPECT_LT(ClosestRms_mm(joint), ClosestRms_mm(prior));
  EXPECT_LT(joint.truth->face.truth_to_face.mean_abs_mm,
            1.05 * prior.truth->face.truth_to_face.mean_abs_mm);
}

TEST(JointFace, DowelsSlideUnlessTheyAreHeld) {
  const RunResult result =
      RunSmall("joint", {"sites={n: {uv: [0.5, 0.6], hold: true}, g: {uv: [0.5, 0.64]}}"});
  int slid = 0;
  for (std::size_t k = 0; k < result.target.points.size(); ++k) {
    const FitPoint& point = result.target.points[k];
    if (point.label == "n") {
      EXPECT_EQ(result.fit.uv[k], Vec2(0.5, 0.6));
    } else if (point.role != PointRole::kSeed) {
      EXPECT_TRUE(point.label != "g" || point.uv == Vec2(0.5, 0.64));  // stated, and free to slide
      slid += (result.fit.uv[k] - point.uv).norm() > 1e-4 ? 1 : 0;
    }
  }
  EXPECT_GT(slid, 20);
}

TEST(JointFace, WithoutSeedsTheDowelsAndTheModelMakeTheFace) {
  const RunResult result = RunSmall("joint", {"seeds=none"});
  ASSERT_TRUE(result.usable());
  EXPECT_TRUE(result.seeding.points.empty());
  for (const LevelSummary& level : result.fit.levels) {
    EXPECT_THAT(TermsOf(level), Not(Contains("seeds")));
  }
}

// Without the rule for bone, bone lies up to 4 mm outside this face.
TEST(JointFace, BoneStaysInsideAFaceWithHardlyAnyTissue) {
  const RunResult result = RunSmall("joint", {"tissue.set_mm={zy_l: 0.5, zy_r: 0.5, lo_l: 0.5, "
                                              "lo_r: 0.5, mio_l: 0.5, mio_r: 0.5}"});
  int judged = 0;
  for (const PlausibilityCheck& check : result.plausibility.checks) {
    if (check.name == "bone_share" || check.name == "bone_most_mm") {
      EXPECT_LT(check.value, 0.002) << check.sentence;
      ++judged;
    }
  }
  EXPECT_EQ(judged, 2);
}

TEST(JointFace, TheNumberOfThreadsChangesNoByteThorough) {
  const RunResult& one = PlainRun("joint");
  const RunResult same = RunSmall("joint", {}, 3);
  EXPECT_EQ(one.fit.surface.Offsets(), same.fit.surface.Offsets());
  EXPECT_EQ(one.fit.surface.Net(0).vertices, same.fit.surface.Net(0).vertices);
}

// A marker that is far too long is named, counts less, and spoils neither face.
TEST(DisagreeingDowel, IsNamedAndDoesNotSpoilTheFaceThorough) {
  for (const char* face : {"prior_then_fit", "joint"}) {
    const RunResult& right = PlainRun(face);
    const RunResult wrong = RunSmall(face, {"sites={mine: {near: [im_l, lo_l], depth: 45}}"});
    EXPECT_THAT(wrong.subject.notes,
                Contains(HasSubstr("the depth marker at mine disagrees with the others")));
    EXPECT_THAT(right.subject.notes, Not(Contains(HasSubstr("disagrees with the others"))));
    EXPECT_LT(wrong.truth->face.truth_to_face.mean_abs_mm,
              1.25 * right.truth->face.truth_to_face.mean_abs_mm)
        << face;
  }
}

TEST(JointFace, RefusesPlansThatAreNoScheduleAndAnotherAim) {
  const auto refused = [](const std::string& plan) {
    try {
      SmallPhantom("joint", {"fit.plan=" + plan});
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refused("adaptive"), HasSubstr("`face: joint` runs the steps of a schedule once"));
  EXPECT_THAT(refused("{type: listed, aim: level}"), HasSubstr("fits the whole surface"));
  EXPECT_EQ(refused("coarse_to_fine"), "accepted");
}

}  // namespace
}  // namespace semblance::problems
