// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/limit_depths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "problems/experiment/experiment_config.h"
#include "problems/experiment/skull_stage.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::WordsOf;

constexpr const char* kMeasured = "{depths: measured}";

// A phantom with depths of a table unless `tissue` says otherwise.
Experiment PhantomWith(const std::string& tissue) {
  const std::vector<std::string> overrides = {"subject.rings=30", "tissue=" + tissue};
  return ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
}

std::string WithTable(const std::string& bounds) {
  return "{depths: table, table: " SEMBLANCE_SOURCE_DIR
         "/configs/tables/t_table_2023.yaml, bounds: " +
         bounds + "}";
}

std::shared_ptr<const DepthStage> Depths(const std::string& tissue) {
  const RunContext context;
  StageCache cache(4);
  StepClock step(context);
  return MakeDepthStage(PhantomWith(tissue), cache, step, context);
}

// The standard site that is nearest to each vertex, by a plain search.
std::vector<std::string> NearestSites(const DepthStage& stage) {
  std::vector<std::string> sites;
  for (const Vec3& p : stage.shell.points) {
    double best = 1e30;
    std::string& nearest = sites.emplace_back();
    for (const auto& [site, at] : stage.subject.basis.sites->points) {
      if ((at - p).norm() < best) {
        best = (at - p).norm();
        nearest = site;
      }
    }
  }
  return sites;
}

bool SameBits(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

TEST(LimitDepths, BoundsThatContainEveryDepthChangeNothing) {
  const auto free = Depths(WithTable("[]"));
  const auto wide =
      Depths(WithTable("[{region: cheeks, least_mm: 0.01, most_mm: 100}, "
                       "{sites: [zy, me], least_mm: 0.01}]"));
  ASSERT_EQ(free->depth.depth_mm.size(), wide->depth.depth_mm.size());
  for (std::size_t v = 0; v < free->depth.depth_mm.size(); ++v) {
    ASSERT_TRUE(SameBits(free->depth.depth_mm[v], wide->depth.depth_mm[v])) << v;
    ASSERT_TRUE(SameBits(free->depth.sd_mm[v], wide->depth.sd_mm[v])) << v;
  }
  EXPECT_EQ(free->subject.notes, wide->subject.notes);
  for (const BoundEffect& effect : wide->subject.bounds) {
    EXPECT_THAT(effect.dowels, IsEmpty());
    EXPECT_GT(effect.bone_cm2, 1);
    EXPECT_EQ(effect.moved_share, 0);
  }
}

TEST(LimitDepths, DepthsAndDeviationsLieWithinTheBoundsWhereTheyHoldAndNowhereElse) {
  const auto stage = Depths(WithTable("[{region: cheeks, least_mm: 9, most_mm: 11}]"));
  const auto free = Depths(WithTable("[]"));
  const std::vector<std::string> sites = NearestSites(*stage);
  int inside = 0;
  for (std::size_t v = 0; v < sites.size(); ++v) {
    const double depth_mm = stage->depth.depth_mm[v];
    if (FacePartOfSite(sites[v]) != static_cast<int>(FacePart::kCheeks) || std::isnan(depth_mm)) {
      continue;
    }
    ++inside;
    ASSERT_GE(depth_mm, 9);
    ASSERT_LE(depth_mm, 11);
    ASSERT_FALSE(stage->depth.sd_mm[v] > 1) << "half of the range";
  }
  EXPECT_GT(inside, 20);
  // Far from the cheeks the dowels that the bound moved matter little: the chin keeps its depth.
  const auto dowel = [](const DepthStage& of, const std::string& site) {
    return std::ranges::find(of.subject.dowels_on_bone, site, &Dowel::site)->depth_mm;
  };
  EXPECT_EQ(dowel(*stage, "pg"), dowel(*free, "pg"));
  EXPECT_NE(dowel(*stage, "sM2_l"), dowel(*free, "sM2_l"));
}

// The shell of a filled skull lies over the bone. The bound counts from the bone.
TEST(LimitDepths, CountsFromTheBoneUnderAFilledSkull) {
  Experiment experiment = PhantomWith(kMeasured);
  experiment.fill = WrapFill{};
  experiment.tissue.bounds = {
      {.sites = {}, .region = FacePart::kCheeks, .least_mm = {}, .most_mm = 9}};
  const auto stage = Depths(kMeasured);
  Case subject = stage->subject;
  subject.bounds = StartEffects(experiment.tissue.bounds);
  constexpr double kLift_mm = 4;
  TriMesh shell = stage->shell;  // that of a phantom is its skull
  for (std::size_t v = 0; v < shell.points.size(); ++v) {
    shell.points[v] += kLift_mm * stage->normals[v];
  }
  DepthField field = stage->depth;
  LimitDepths(experiment, shell, subject, field);
  const MeshQuery bone(subject.skull);
  const std::vector<std::string> sites = NearestSites(*stage);
  int moved = 0;
  for (std::size_t v = 0; v < sites.size(); ++v) {
    if (FacePartOfSite(sites[v]) == static_cast<int>(FacePart::kCheeks) &&
        field.depth_mm[v] != stage->depth.depth_mm[v]) {
      ++moved;
      EXPECT_NEAR(field.depth_mm[v] + bone.Closest(shell.points[v]).distance_mm, 9, 1e-9);
    }
  }
  EXPECT_GT(moved, 20);
}

// The same depths limited by ranges that lie above each other keep their order.
TEST(LimitDepths, IsMonotoneInTheBounds) {
  Experiment low = PhantomWith(kMeasured), high = low;
  low.tissue.bounds = {{.sites = {}, .region = FacePart::kJaw, .least_mm = 3, .most_mm = 9}};
  high.tissue.bounds = {{.sites = {}, .region = FacePart::kJaw, .least_mm = 5, .most_mm = 14}};
  const auto stage = Depths(kMeasured);
  DepthField lower = stage->depth, upper = stage->depth;
  Case first = stage->subject, second = stage->subject;
  first.bounds = StartEffects(low.tissue.bounds);
  second.bounds = StartEffects(high.tissue.bounds);
  LimitDepths(low, stage->shell, first, lower);
  LimitDepths(high, stage->shell, second, upper);
  for (std::size_t v = 0; v < lower.depth_mm.size(); ++v) {
    ASSERT_FALSE(lower.depth_mm[v] > upper.depth_mm[v]) << v;
  }
  DepthField twice = lower;
  LimitDepths(low, stage->shell, first, twice);
  EXPECT_EQ(first.bounds[0].moved_share, 0) << "limited depths are within the bounds";
}

TEST(LimitDepths, ResultNamesMovedDowelsAndTheShareOfBone) {
  const auto stage = Depths(WithTable("[{sites: [zy], most_mm: 3}]"));
  const BoundEffect& effect = stage->subject.bounds.at(0);
  EXPECT_THAT(effect.dowels, ElementsAre("zy_l", "zy_r"));
  EXPECT_GT(effect.moved_share, 0);
  EXPECT_LE(effect.moved_share, 1);
  EXPECT_THAT(stage->subject.notes,
              Contains(AllOf(HasSubstr("site zy_l"), HasSubstr("at most 3 mm (tissue.bounds[0])"),
                             HasSubstr("3 mm is used"))));
}

TEST(LimitDepths, KnownDepthsBeyondABoundAreRefused) {
  const auto words = [](const std::string& tissue) {
    return WordsOf<InputError>([&] { Depths(tissue); });
  };
  EXPECT_THAT(words("{depths: measured, bounds: [{sites: [zy_l], most_mm: 0.5}]}"),
              AllOf(HasSubstr("site zy_l"), HasSubstr("known depth"),
                    HasSubstr("at most 0.5 mm (tissue.bounds[0]); correct one of them")));
}

TEST(LimitDepths, ContradictionsInTheConfigurationAreFaultsAtTheirLine) {
  const auto faults = [](const std::string& text) {
    return WordsOf<ConfigError>([&] { ReadConfigText<Experiment>(text, "a.yaml"); });
  };
  EXPECT_THAT(faults("tissue:\n  bounds:\n    - {sites: [zy], least_mm: 9, most_mm: 4}\n"),
              HasSubstr("a.yaml:3:31: tissue.bounds[0].least_mm: it is above `most_mm`"));
  EXPECT_THAT(faults("tissue:\n  bounds:\n    - {sites: [zy], most_mm: 4}\n"
                     "    - {region: cheeks, least_mm: 6}\n"),
              HasSubstr("a.yaml:4:34: tissue.bounds[1].least_mm: at zy_l"));
  EXPECT_THAT(faults("tissue:\n  bounds: [{region: chin, most_mm: 4}]\n  set_mm: {pg: 9}\n"),
              HasSubstr("a.yaml:3:16: tissue.set_mm.pg: the known depth of 9 mm is not within at "
                        "most 4 mm (tissue.bounds[0])"));
  EXPECT_THAT(faults("sites: {pg: {depth: 9}}\ntissue: {bounds: [{region: chin, most_mm: 4}]}\n"),
              HasSubstr("a.yaml:1:21: sites.pg.depth: the known depth"));
  EXPECT_THAT(faults("tissue: {bounds: [{sites: [elbow], most_mm: 4}]}\n"), HasSubstr("elbow"));
  EXPECT_THAT(faults("tissue: {bounds: [{most_mm: 4}]}\n"), HasSubstr("holds nowhere"));
  EXPECT_THAT(faults("tissue: {bounds: [{sites: [zy]}]}\n"), HasSubstr("limits nothing"));
}

// A side with a depth of its own does not have the pair's.
TEST(LimitDepths, APairsDepthIsCheckedOnTheSidesThatHaveIt) {
  EXPECT_NO_THROW(ReadConfigText<Experiment>(
      "tissue:\n  bounds: [{sites: [go_l], most_mm: 9}]\n  set_mm: {go: 12, go_l: 8}\n", "a.yaml"));
}

}  // namespace
}  // namespace semblance::problems
