// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/hspline_batch.h"

#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

using testing::RandomSurface;

std::vector<Vec2> RandomParameters(int count, double lowest = -0.2, double highest = 1.2) {
  Random random(31);
  std::vector<Vec2> uv;
  for (int k = 0; k < count; ++k) {
    uv.emplace_back(random.Uniform(lowest, highest), random.Uniform(lowest, highest));
  }
  return uv;
}

class BatchLaws : public ::testing::TestWithParam<HSplineShape> {};

TEST_P(BatchLaws, PointsAndNormalsAreThoseOfTheSurface) {
  const HSplineSurface surface = RandomSurface(GetParam(), 1);
  std::vector<Vec2> uv = RandomParameters(3000);
  for (const double u : {0.0, 0.25, 0.5, 1.0}) {
    for (const double v : {0.0, 0.125, 1.0}) {
      uv.emplace_back(u, v);
    }
  }
  const HSplineBatch batch(surface);
  const SurfaceSamples samples = batch.PointsAndNormals(uv);
  EXPECT_EQ(samples.degenerate, 0);
  EXPECT_EQ(samples.points, batch.Points(uv));
  for (std::size_t k = 0; k < uv.size(); ++k) {
    ASSERT_LT((samples.points[k] - surface.Point(uv[k])).norm(),
              1e-12 * surface.Point(uv[k]).norm());
    ASSERT_LT((samples.normals[k] - surface.Normal(uv[k])).norm(), 1e-12);
  }
}

TEST_P(BatchLaws, PointsAreThoseOfThePlainBSplineOfTheFinestNet) {
  const HSplineShape shape = GetParam();
  if (shape.closure != Closure::kOpen) {
    GTEST_SKIP() << "the oracle is of open nets";
  }
  const HSplineSurface surface = RandomSurface(shape, 2);
  const std::vector<Vec2> uv = RandomParameters(500, 0, 1);
  const std::vector<Vec3> points = HSplineBatch(surface).Points(uv);
  const int level = shape.max_level;
  for (std::size_t k = 0; k < uv.size(); ++k) {
    const Stencil plain =
        testing::PlainStencil(shape.PatchesU(level), shape.PatchesV(level), uv[k]);
    ASSERT_LT((points[k] - plain.Apply(surface.Net(level))).norm(), 1e-10);
  }
}

TEST_P(BatchLaws, LeavesCoverTheDomainOnceAndHoldTheirPlaces) {
  const HSplineSurface surface = RandomSurface(GetParam(), 3);
  const PatchTree tree(surface);
  double area = 0;
  for (const PatchId& leaf : tree.leaves()) {
    area += 1.0 / surface.shape().PatchesU(leaf.level) / surface.shape().PatchesV(leaf.level);
  }
  EXPECT_NEAR(area, 1, 1e-12);
  for (const Vec2& uv : RandomParameters(300, 0, 1)) {
    const PatchId leaf = tree.leaves()[tree.LeafAt(uv)];
    EXPECT_EQ(PatchPointAt(surface.shape(), leaf.level, uv).patch, leaf);
  }
}

TEST_P(BatchLaws, NoByteDependsOnTheNumberOfThreads) {
  const HSplineSurface surface = RandomSurface(GetParam(), 4);
  const HSplineBatch batch(surface);
  const std::vector<Vec2> uv = RandomParameters(150'000);
  const SurfaceSamples one = batch.PointsAndNormals(uv, 1), three = batch.PointsAndNormals(uv, 3);
  EXPECT_EQ(one.points, three.points);
  EXPECT_EQ(one.normals, three.normals);
  const SurfaceSamples alone = batch.PointsAndNormals({&uv[100'000], 1});
  EXPECT_EQ(alone.points[0], one.points[100'000]);
  EXPECT_EQ(alone.normals[0], one.normals[100'000]);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, BatchLaws,
    ::testing::Values(HSplineShape{.patches_u = 4, .patches_v = 5, .max_level = 3},
                      HSplineShape{.patches_u = 3, .patches_v = 2, .max_level = 6},
                      HSplineShape{.patches_u = 5,
                                   .patches_v = 4,
                                   .max_level = 2,
                                   .closure = Closure::kPeriodicU}));

TEST(HSplineBatch, MemoryGrowsWithTheDetailAndNotWithTheLevel) {
  HSplineSurface surface =
      testing::SmoothSurface({.patches_u = 8, .patches_v = 8, .max_level = 7}, 1);
  const std::size_t bytes = HSplineBatch(surface).Bytes();
  EXPECT_LT(bytes, 64 * 700u);
  surface.SetOffsets({{{7, 501, 501}, Vec3(0, 0, 1)}});
  EXPECT_LT(HSplineBatch(surface).Bytes(), bytes + 7 * 16 * 3 * 700u);
}

TEST(HSplineBatch, NormalsThatDoNotExistAreZeroAndCounted) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 1};
  const HSplineSurface point(shape, {7, 7, std::vector<Vec3>(49, Vec3(1, 2, 3))});
  const std::vector<Vec2> uv = RandomParameters(10);
  const SurfaceSamples samples = HSplineBatch(point).PointsAndNormals(uv);
  EXPECT_EQ(samples.degenerate, 10);
  for (std::size_t k = 0; k < uv.size(); ++k) {
    EXPECT_EQ(samples.normals[k], Vec3::Zero());
    EXPECT_LT((samples.points[k] - Vec3(1, 2, 3)).norm(), 1e-14);
  }
}

TEST(HSplineBatch, ParametersThatAreNotFiniteAreNamed) {
  const HSplineSurface surface = testing::SmoothSurface({.max_level = 0}, 1);
  const std::vector<Vec2> uv = {Vec2(0, 0), Vec2(kNaN, 0)};
  EXPECT_THROW(HSplineBatch(surface).Points(uv), InputError);
  EXPECT_TRUE(HSplineBatch(surface).Points({}).empty());
}

}  // namespace
}  // namespace semblance::surfaces
