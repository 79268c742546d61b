// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/outside_rule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "interp/schemes/network_schemes.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::DomeScene;
using testing::DowelScene;
using testing::FlatScene;
using testing::SameBytes;

DepthField FieldOf(const OutsideRule& rule, const DowelScene& scene, const RunContext& run = {}) {
  return ApplyOutsideRule(rule, scene.Input(), InterpolateDepth(Barycentric{}, scene.Input(), run),
                          run);
}

RunContext Hearing(std::function<void(const Event&)> on_event) {
  RunContext run;
  run.on_event = std::move(on_event);
  return run;
}

TEST(OutsideRule, ChangesOnlyDepthsThatTheSchemeLeft) {
  const DowelScene scene = DomeScene();
  const DepthField before = InterpolateDepth(Barycentric{}, scene.Input(), RunContext{});
  for (const OutsideRule& rule : {OutsideRule(ExtendNetwork{}), OutsideRule(ConstantDepth{}),
                                  OutsideRule(LeaveUnassigned{})}) {
    const DepthField after = ApplyOutsideRule(rule, scene.Input(), before, RunContext{});
    EXPECT_EQ(after.status, before.status);
    for (std::size_t i = 0; i < before.status.size(); ++i) {
      if (before.status[i] == DepthStatus::kAssigned) {
        ASSERT_EQ(after.depth_mm[i], before.depth_mm[i]);
        ASSERT_EQ(after.sd_mm[i], before.sd_mm[i]);
      } else {
        ASSERT_EQ(std::isfinite(after.depth_mm[i]), !std::holds_alternative<LeaveUnassigned>(rule));
      }
    }
  }
}

TEST(OutsideRule, TheNumberOfThreadsDoesNotMatter) {
  const DowelScene scene = DomeScene();
  EXPECT_TRUE(SameBytes(FieldOf(ExtendNetwork{}, scene, testing::OnThreads(1)),
                        FieldOf(ExtendNetwork{}, scene, testing::OnThreads(2))));
}

TEST(OutsideRule, ExtendStaysWithinTheDowels) {
  for (const double depth : FieldOf(ExtendNetwork{}, DomeScene()).depth_mm) {
    ASSERT_GE(depth, 4.5 - 1e-12);
    ASSERT_LE(depth, 11 + 1e-12);
  }
}

TEST(OutsideRule, ExtendIsContinuousAtTheBorderOfTheNetwork) {
  const DowelScene scene = DomeScene();
  const Vec3 a = scene.dowels[0].base, b = scene.dowels[1].base;  // an edge of one area only
  const Vec3 out = (a - b).cross(scene.dowels[0].direction).normalized();
  std::vector<Vec3> points;
  for (int s = 1; s < 100; ++s) {
    const Vec3 on_border = a + (b - a) * s / 100.0;
    points.insert(points.end(), {on_border - 1e-5 * out, on_border + 1e-5 * out});
  }
  const DowelScene at = scene.At(points, {0, -1, 0});
  const DepthField status = InterpolateDepth(Barycentric{}, at.Input(), RunContext{});
  const DepthField field = FieldOf(ExtendNetwork{}, at);
  for (std::size_t i = 0; i < points.size(); i += 2) {
    ASSERT_NE(status.status[i], status.status[i + 1]);
    ASSERT_NEAR(field.depth_mm[i], field.depth_mm[i + 1], 1e-4);
  }
}

TEST(OutsideRule, ExtendTakesTheClosestOfAllTriangles) {
  const DowelScene dome = DomeScene();
  Random random(11);
  std::vector<Vec3> points(500);
  std::ranges::generate(points, [&] { return random.InBox(-150, 150); });
  const DowelScene scene = dome.At(points);
  const DepthField field = ApplyOutsideRule(ExtendNetwork{.blend_mm = 1e9}, scene.Input(),
                                            EmptyDepthField(points.size()), RunContext{});
  for (std::size_t i = 0; i < points.size(); ++i) {
    double nearest = 1e9, depth = kNaN;
    for (const auto& [a, b, c] : dome.network.areas) {
      const Dowel &da = dome.dowels[a], &db = dome.dowels[b], &dc = dome.dowels[c];
      const TrianglePoint on = ClosestPointOnTriangle(points[i], da.base, db.base, dc.base);
      if ((points[i] - on.position).norm() < nearest) {
        nearest = (points[i] - on.position).norm();
        depth = on.weights.dot(Vec3(da.depth_mm, db.depth_mm, dc.depth_mm));
      }
    }
    ASSERT_NEAR(field.depth_mm[i], depth, 1e-9);
  }
}

// From the corner "n" (9 mm) of the flat scene outwards, with a mean depth of 6.25 mm.
std::vector<double> DepthsAlongARay(double blend_mm, double step_mm, int count) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) {
    points.push_back(Vec3(35, 35, 0) + (i * step_mm + 1e-6) * Vec3(0.6, 0.8, 0));
  }
  return FieldOf(ExtendNetwork{.blend_mm = blend_mm}, FlatScene().At(points)).depth_mm;
}

TEST(OutsideRule, ExtendTendsToTheSitesDepthFarAway) {
  const std::vector<double> depth = DepthsAlongARay(60, 0.25, 400);
  EXPECT_EQ(depth[24], 9);                       // 6 mm off
  EXPECT_NEAR(depth[145], (9 + 4) / 2.0, 1e-6);  // half way at 6.25 + 30 mm
  EXPECT_EQ(depth[266], 4);                      // from 66.25 mm on
  EXPECT_EQ(depth.back(), 4);
  EXPECT_TRUE(std::ranges::is_sorted(depth, std::greater<>()));
}

TEST(OutsideRule, ExtendBlendsWithoutKink) {
  const std::vector<double> depth = DepthsAlongARay(20, 0.01, 4000);
  double greatest_bend = 0;
  for (std::size_t i = 1; i + 1 < depth.size(); ++i) {
    greatest_bend = std::max(greatest_bend,
                             std::abs(depth[i + 1] - 2 * depth[i] + depth[i - 1]) / (0.01 * 0.01));
  }
  // A smooth step bends by at most 6 * (9 - 4) / 20^2; a kink would bend by slope / step, some 25.
  EXPECT_LT(greatest_bend, 6 * 5 / 400.0 + 1e-3);
}

TEST(OutsideRule, ExtendWithoutBlendSwitchesAtOnce) {
  const std::vector<double> depth = DepthsAlongARay(0, 0.5, 30);
  EXPECT_EQ(depth[12], 9);
  EXPECT_EQ(depth[13], 4);
}

TEST(OutsideRule, ExtendWithoutAnAreaIsTheSitesDepth) {
  DowelScene scene = FlatScene();
  scene.network.areas.clear();
  const DepthField field =
      ApplyOutsideRule(ExtendNetwork{}, scene.Input(), EmptyDepthField(441), RunContext{});
  EXPECT_THAT(field.depth_mm, ::testing::Each(4));
  EXPECT_THAT(field.sd_mm, ::testing::Each(1));
}

TEST(OutsideRule, ConstantIsTheSitesDepthOrTheGivenOne) {
  const DowelScene scene = FlatScene().At({{0, 0, 0}, {20, 10, 0}, {60, 0, 0}});
  DepthField field = FieldOf(ConstantDepth{.site = "g"}, scene);
  EXPECT_EQ(field.depth_mm[0], 7);
  EXPECT_EQ(field.sd_mm[0], 2);
  EXPECT_EQ(field.depth_mm[2], 7);
  field = FieldOf(ConstantDepth{.site = "nowhere", .depth_mm = 3.5}, scene,
                  Hearing([](const Event&) { FAIL() << "the site is not needed"; }));
  EXPECT_EQ(field.depth_mm[0], 3.5);
  EXPECT_TRUE(std::isnan(field.sd_mm[0]));
  EXPECT_NE(field.depth_mm[1], 3.5);
}

TEST(OutsideRule, BoneThatFacesAwayCountsAsOutside) {
  const DowelScene scene = FlatScene().At({{20, 10, 0}}, {0, 0, -1});
  const DepthField field = FieldOf(ConstantDepth{}, scene);
  EXPECT_EQ(field.status[0], DepthStatus::kNotFacing);
  EXPECT_EQ(field.depth_mm[0], 4);
}

TEST(OutsideRule, AMissingSiteGivesTheMeanAndIsReported) {
  DowelScene scene = FlatScene().At({{500, 0, 0}});
  for (const OutsideRule& rule :
       {OutsideRule(ExtendNetwork{.site = "pg"}), OutsideRule(ConstantDepth{.site = "pg"})}) {
    std::vector<std::string> heard;
    const DepthField field = FieldOf(
        rule, scene, Hearing([&](const Event& e) { heard.push_back(e.step + ": " + e.message); }));
    EXPECT_EQ(field.depth_mm[0], 6.25);
    EXPECT_THAT(heard,
                ::testing::ElementsAre("outside rule: no dowel at 'pg'; the mean depth of all "
                                       "dowels, 6.25 mm, is used instead"));
  }
}

TEST(OutsideRule, RefusesTheFieldOfAnotherSkull) {
  try {
    ApplyOutsideRule(LeaveUnassigned{}, FlatScene().Input(), EmptyDepthField(440), RunContext{});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "depth field: 440 entries for 441 vertices; it must be of this skull");
  }
}

}  // namespace
}  // namespace semblance::interp
