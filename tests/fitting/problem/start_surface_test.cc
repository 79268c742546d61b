// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/start_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::fitting {
namespace {

struct Points {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
};

template <class Place>
Points PointsOf(const Place& place) {
  Random random(2);
  Points points;
  for (int k = 0; k < 50; ++k) {
    points.uv.emplace_back(random.Uniform(0, 1), random.Uniform(0, 1));
    points.positions.push_back(place(points.uv.back()));
  }
  return points;
}

TEST(StartSurface, AnOpenSurfaceReproducesPlanes) {
  const auto place = [](const Vec2& uv) {
    return Vec3(80 * uv.x() + 3, 10 * uv.x() - 60 * uv.y(), 5 + uv.y());
  };
  const Points points = PointsOf(place);
  const HSplineSurface surface =
      StartSurface({.patches_u = 3, .patches_v = 5, .max_level = 1}, points.positions, points.uv);
  for (const Vec2& uv : points.uv) {
    EXPECT_LT((surface.Point(uv) - place(uv)).norm(), 1e-9);
  }
}

// A cubic B-spline with vertices on a circle lies slightly inside it: with n patches around, its
// radius at the knots is (2 + cos(2 pi / n)) / 3 times the circle's.
TEST(StartSurface, APeriodicSurfaceIsATube) {
  constexpr int kPatches = 16;
  const auto place = [](const Vec2& uv) {
    const double angle = 2 * std::numbers::pi * uv.x();
    return Vec3(30 * std::cos(angle), 30 * std::sin(angle), 100 * uv.y());
  };
  const Points points = PointsOf(place);
  const HSplineSurface surface = StartSurface(
      {.patches_u = kPatches, .patches_v = 4, .max_level = 0, .closure = Closure::kPeriodicU},
      points.positions, points.uv);
  const double shrunk = (2 + std::cos(2 * std::numbers::pi / kPatches)) / 3;
  for (int i = 0; i < kPatches; ++i) {
    const Vec2 knot(i / static_cast<double>(kPatches), 0.5);
    const Vec3 expected = place(knot).cwiseProduct(Vec3(shrunk, shrunk, 1));
    EXPECT_LT((surface.Point(knot) - expected).norm(), 1e-9);
  }
}

TEST(StartSurface, NeedsUvForEachPoint) {
  const Points points = PointsOf([](const Vec2& uv) { return Vec3(uv.x(), uv.y(), 0); });
  const HSplineShape shape{.patches_u = 4, .patches_v = 4};
  EXPECT_THROW(StartSurface(shape, {}, {}), InputError);
  EXPECT_THROW(StartSurface(shape, points.positions, std::span(points.uv).first(3)), InputError);
}

}  // namespace
}  // namespace semblance::fitting
