// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/skull_pose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/subject/phantom.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;

Similarity AnyPose(Random& random) {
  return {
      .scale = random.Uniform(0.85, 1.2),
      .rotation = Eigen::AngleAxisd(random.Uniform(0, 3.1), random.Direction()).toRotationMatrix(),
      .translation = random.InBox(-300, 300)};
}

SkullShell PhantomShell(std::uint64_t random_seed, const Similarity& pose = {}) {
  return AsShell(Transformed(MakePhantom({.random_seed = random_seed, .rings = 50}).skull, pose));
}

TEST(SkullPose, SimilaritiesComposeAndInvert) {
  Random random(1);
  const Similarity a = AnyPose(random), b = AnyPose(random);
  const Vec3 p = random.InBox(-100, 100);
  EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-9);
  EXPECT_LT((Inverse(a) * (a * p) - p).norm(), 1e-9);
}

// Points on a curved surface, and the same a little moved: one step brings them close, two closer.
TEST(SkullPose, AStepGoesMostOfASmallWay) {
  const SkullShell shell = PhantomShell(1);
  const Similarity small = {
      .scale = 1.01,
      .rotation = Eigen::AngleAxisd(0.02, Vec3(1, 2, 3).normalized()).toRotationMatrix(),
      .translation = Vec3(0.5, -1, 0.7)};
  Similarity found;
  const std::vector<ShellPoint> points = SpreadPoints(shell, 15);
  for (int step = 0; step < 2; ++step) {
    std::vector<ShellMatch> matches;
    for (const ShellPoint& p : points) {
      matches.push_back({.from = found * p.position,
                         .to = small * p.position,
                         .normal = p.normal,
                         .distance_mm = 0});
    }
    found = StepTowards(matches, /*scale_too=*/true) * found;
  }
  for (const ShellPoint& p : points) {
    EXPECT_LT((found * p.position - small * p.position).norm(), 0.05);
  }
  EXPECT_NEAR(found.scale, 1.01, 1e-3);
}

TEST(SkullPose, WithoutScaleTheSizeStays) {
  const std::vector<ShellMatch> apart = {
      {.from = {1, 0, 0}, .to = {2, 0, 0}, .normal = {1, 0, 0}, .distance_mm = 1},
      {.from = {-1, 0, 0}, .to = {-2, 0, 0}, .normal = {-1, 0, 0}, .distance_mm = 1}};
  EXPECT_EQ(StepTowards(apart, /*scale_too=*/false).scale, 1);
  EXPECT_GT(StepTowards(apart, /*scale_too=*/true).scale, 1.01);
}

// A smooth head slides over itself for long; the warp's first round reaches 25 mm.
TEST(SkullPose, TheSameSkullIsFoundInAnyPose) {
  Random random(3);
  const SkullShell reference = PhantomShell(5);
  for (int trial = 0; trial < 2; ++trial) {
    const Similarity truth = AnyPose(random);
    const SkullPose pose = FindPose(reference, PhantomShell(5, truth), 1);
    EXPECT_EQ(PoseFault(pose), "");
    for (const Vec3& p : {Vec3(0, 0, 0), Vec3(50, 70, -85), Vec3(-30, 10, 44)}) {
      EXPECT_LT((pose.skull_from_reference * p - truth * p).norm(), 20) << trial;
    }
  }
}

TEST(SkullPose, ABallLiesInNoPose) {
  const SkullShell ball = AsShell(testing::SphereMesh(Vec3::Zero(), 90, 40));
  EXPECT_THAT(PoseFault(FindPose(PhantomShell(1), ball, 1)),
              HasSubstr("does not determine its pose"));
}

TEST(SkullPose, ANeedleIsNoSkull) {
  TriMesh needle = testing::SphereMesh(Vec3::Zero(), 100, 40);
  for (Vec3& p : needle.points) {
    p = p.cwiseProduct(Vec3(0.1, 0.1, 1));
  }
  EXPECT_THAT(PoseFault(FindPose(PhantomShell(1), AsShell(needle), 1)),
              HasSubstr("no pose brings it"));
}

}  // namespace
}  // namespace semblance::problems
