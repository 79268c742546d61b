// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/hspline_project.h"

#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

using testing::RandomSurface;
using testing::SmoothSurface;

const HSplineShape kOpen{.patches_u = 5, .patches_v = 6, .max_level = 2};
const HSplineShape kTube{
    .patches_u = 6, .patches_v = 6, .max_level = 2, .closure = Closure::kPeriodicU};

double ParameterDistance(const HSplineShape& shape, const Vec2& a, const Vec2& b) {
  const auto apart = [](double x, double y, bool closed) {
    return closed ? std::min(std::abs(x - y), 1 - std::abs(x - y)) : x - y;
  };
  return std::hypot(apart(a.x(), b.x(), shape.ClosedU()), a.y() - b.y());
}

TEST(HSplineProject, RecoversTheParameterOfAPointOffTheSurface) {
  for (const HSplineShape& shape : {kOpen, kTube}) {
    const HSplineSurface surface = SmoothSurface(shape, 1);
    const SurfaceProjector projector(surface);
    Random random(1);
    for (int k = 0; k < 200; ++k) {
      const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
      const double height = random.Uniform(-3, 3);
      const Vec3 point = surface.Point(uv) + height * surface.Normal(uv);
      const SurfaceProjection found = projector.Project(point);
      EXPECT_TRUE(found.converged);
      EXPECT_LT(ParameterDistance(shape, found.uv, uv), 1e-8);
      EXPECT_NEAR(found.distance_mm, std::abs(height), 1e-9);
      EXPECT_EQ(found.point, surface.Point(found.uv));
    }
  }
}

TEST(HSplineProject, NoSampleOfAWrinkledSurfaceIsCloser) {
  for (const HSplineShape& shape : {kOpen, kTube}) {
    const HSplineSurface surface = RandomSurface(shape, 2);
    const SurfaceProjector projector(surface);
    Random random(2);
    for (int k = 0; k < 60; ++k) {
      const Vec3 point(random.Uniform(-70, 70), random.Uniform(-70, 70), random.Uniform(-10, 90));
      const SurfaceProjection found = projector.Project(point);
      EXPECT_TRUE(found.converged);
      double least = 1e9;
      for (int s = 0; s < 120 * 120; ++s) {
        least = std::min(least, (surface.Point({s % 120 / 119.0, s / 120 / 119.0}) - point).norm());
      }
      EXPECT_LE(found.distance_mm, least + 1e-9) << point.transpose();
    }
  }
}

TEST(HSplineProject, TheResidualIsNormalInsideAndPointsOutwardAtABorder) {
  const HSplineSurface surface = RandomSurface(kOpen, 3);
  const SurfaceProjector projector(surface);
  Random random(3);
  int at_border = 0;
  for (int k = 0; k < 100; ++k) {
    const Vec3 point(random.Uniform(-70, 70), random.Uniform(-70, 70), random.Uniform(-30, 120));
    const SurfaceProjection found = projector.Project(point);
    const SurfaceFrame frame = surface.Frame(found.uv);
    for (int axis = 0; axis < 2; ++axis) {
      const double along =
          (point - frame.point).dot((axis == 0 ? frame.du : frame.dv).normalized());
      if (found.uv[axis] == 0 || found.uv[axis] == 1) {
        EXPECT_GE(found.uv[axis] == 1 ? along : -along, -1e-7);
        ++at_border;
      } else {
        EXPECT_NEAR(along, 0, 1e-7) << point.transpose();
      }
    }
  }
  EXPECT_GT(at_border, 10);
}

TEST(HSplineProject, AWarmStartCrossesTheSeam) {
  const HSplineSurface surface = SmoothSurface(kTube, 4);
  const Vec3 point = surface.Point({0.02, 0.4}) + 2 * surface.Normal({0.02, 0.4});
  const SurfaceProjection found = ProjectFrom(surface, point, {0.97, 0.45});
  EXPECT_TRUE(found.converged);
  EXPECT_LT((found.uv - Vec2(0.02, 0.4)).norm(), 1e-8);
  EXPECT_LE(found.iterations, 10);
}

TEST(HSplineProject, ASurfaceInOnePointGivesItsDistance) {
  const HSplineSurface surface({.patches_u = 4, .patches_v = 4, .max_level = 0},
                               {7, 7, std::vector<Vec3>(49, Vec3(1, 2, 3))});
  const SurfaceProjection found = SurfaceProjector(surface).Project({1, 2, 8});
  EXPECT_NEAR(found.distance_mm, 5, 1e-12);
  EXPECT_TRUE(found.uv.allFinite());
}

TEST(HSplineProject, RefusesInvalidInput) {
  const HSplineSurface surface = SmoothSurface(kOpen, 1);
  EXPECT_THROW(SurfaceProjector(surface).Project({0, kNaN, 0}), InputError);
  EXPECT_THROW(ProjectFrom(surface, Vec3::Zero(), {kNaN, 0}), InputError);
  EXPECT_THROW(ProjectFrom(surface, Vec3::Zero(), {0, 0}, {.tolerance_mm = 0}), InputError);
  EXPECT_THROW(SurfaceProjector(surface, {.samples_per_patch = 0}), InputError);
}

TEST(HSplineProject, FindsDetailOfLevelEight) {
  HSplineSurface surface = SmoothSurface({.patches_u = 4, .patches_v = 4, .max_level = 8}, 5);
  const VertexId spike{8, 402, 555};
  surface.SetOffsets({{spike, Vec3(0, 0, 4)}});
  const Vec2 top = surface.GrevillePoint(spike);
  const Vec3 outside = surface.Point(top) + 0.01 * surface.LevelFrame(0, top).Normal();
  const SurfaceProjection found = SurfaceProjector(surface).Project(outside);
  EXPECT_TRUE(found.converged);
  EXPECT_LE(found.distance_mm, 0.01 + 1e-9);
}

}  // namespace
}  // namespace semblance::surfaces
