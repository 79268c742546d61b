// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/trimmed_tessellation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_check.h"
#include "tests/testing/splines.h"

namespace semblance {
namespace {

using testing::RandomSurface;

constexpr double kChord = 0.1;

class TrimLaws : public ::testing::TestWithParam<HSplineShape> {};

// On the surface, in part of the domain, across its borders too.
std::vector<Vec3> Scattered(const HSplineSurface& surface, int count) {
  Random random(5);
  std::vector<Vec3> points;
  for (int k = 0; k < count; ++k) {
    const double u = random.Uniform(-0.15, 0.3), v = random.Uniform(-0.15, 0.3);
    points.push_back(surface.Point({u - std::floor(u), v - std::floor(v)}));
  }
  return points;
}

double Cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

// The shorter way round where the surface is closed.
Vec2 Way(const HSplineShape& shape, const Vec2& from, const Vec2& to) {
  const Vec2 way = to - from;
  return {way.x() - (shape.ClosedU() ? std::round(way.x()) : 0),
          way.y() - (shape.ClosedV() ? std::round(way.y()) : 0)};
}

// Whether a triangle of the domain covers a place; it is brought there over a seam as a whole.
bool Covers(const HSplineShape& shape, const Tessellation& t, const Triangle& triangle,
            const Vec2& place) {
  std::array<Vec2, 3> corners = {Way(shape, place, t.uv[triangle[0]])};
  for (const int k : {1, 2}) {
    corners[k] = corners[0] + Way(shape, t.uv[triangle[0]], t.uv[triangle[k]]);
  }
  constexpr double kRounding = 1e-12;
  return Cross(corners[0], corners[1]) >= -kRounding &&
         Cross(corners[1], corners[2]) >= -kRounding && Cross(corners[2], corners[0]) >= -kRounding;
}

TEST_P(TrimLaws, WhatIsNearIsThereAndWhatIsFarIsNot) {
  const HSplineSurface surface = RandomSurface(GetParam(), 1);
  const std::vector<Vec3> points = Scattered(surface, 40);
  const PointQuery near(points);
  for (const double distance : {3.0, 8.0}) {
    const Tessellation kept = TessellateNear(surface, kChord, near, distance).kept;
    for (const Vec3& p : kept.mesh.points) {
      EXPECT_LE(near.DistanceTo(p), distance);
    }
    Random random(9);
    int inside = 0, outside = 0;
    for (int k = 0; k < 400; ++k) {
      const Vec2 place(random.Uniform(0, 1), random.Uniform(0, 1));
      const double from = near.DistanceTo(surface.Point(place));
      if (std::abs(from - distance) <= distance / 4) {
        continue;  // at the border
      }
      const bool covered = std::ranges::any_of(kept.mesh.triangles, [&](const Triangle& t) {
        return Covers(GetParam(), kept, t, place);
      });
      EXPECT_EQ(covered, from < distance) << place.transpose() << ' ' << from;
      ++(covered ? inside : outside);
    }
    EXPECT_GT(inside, 5);
    EXPECT_GT(outside, 10);
  }
}

TEST_P(TrimLaws, IsAManifoldOfTheSurfacesVertices) {
  const HSplineSurface surface = RandomSurface(GetParam(), 2);
  const PointQuery near(Scattered(surface, 60));
  const TrimmedTessellation t = TessellateNear(surface, kChord, near, 6);
  const EdgeReport edges = CheckEdges(t.kept.mesh);
  EXPECT_EQ(edges.non_manifold + edges.inconsistent, 0);
  EXPECT_GT(edges.boundary, 0);
  ASSERT_EQ(t.kept.mesh.points.size(), t.kept.uv.size());
  ASSERT_EQ(t.kept.normals.size(), t.kept.uv.size());
  std::vector<char> used(t.kept.uv.size());
  for (const Triangle& triangle : t.kept.mesh.triangles) {
    for (const int corner : triangle) {
      used[corner] = 1;
    }
  }
  for (std::size_t k = 0; k < t.kept.uv.size(); ++k) {
    EXPECT_EQ(used[k], 1);
    EXPECT_LT((t.kept.mesh.points[k] - surface.Point(t.kept.uv[k])).norm(), 1e-11);
    EXPECT_LT((t.kept.normals[k] - surface.Normal(t.kept.uv[k])).norm(), 1e-10);
  }
}

TEST_P(TrimLaws, NearEverywhereIsTheWholeSurface) {
  const HSplineSurface surface = RandomSurface(GetParam(), 3);
  const Tessellation whole = TessellateToChord(surface, kChord);
  const TrimmedTessellation t =
      TessellateNear(surface, kChord, PointQuery(Scattered(surface, 5)), 1e4);
  EXPECT_EQ(t.cut_mm2, 0);
  EXPECT_EQ(t.kept.mesh.triangles.size(), whole.mesh.triangles.size());
  const double area = Area(whole.mesh);
  EXPECT_NEAR(t.kept_mm2, area, 1e-9 * area);
}

TEST_P(TrimLaws, ThreadsChangeNoByte) {
  const HSplineSurface surface = RandomSurface(GetParam(), 4);
  const PointQuery near(Scattered(surface, 50));
  const TrimmedTessellation one = TessellateNear(surface, kChord, near, 5, 1),
                            three = TessellateNear(surface, kChord, near, 5, 3);
  EXPECT_EQ(one.kept.mesh.points, three.kept.mesh.points);
  EXPECT_EQ(one.kept.mesh.triangles, three.kept.mesh.triangles);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, TrimLaws,
    ::testing::Values(
        HSplineShape{.patches_u = 4, .patches_v = 5, .max_level = 2},
        HSplineShape{.patches_u = 1, .patches_v = 1, .max_level = 5},
        HSplineShape{
            .patches_u = 5, .patches_v = 4, .max_level = 2, .closure = Closure::kPeriodicU},
        HSplineShape{
            .patches_u = 5, .patches_v = 4, .max_level = 2, .closure = Closure::kPeriodicUv}));

// A square of 100 mm.
HSplineSurface Plate() {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 0};
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      net.vertices.emplace_back(25.0 * (i - 1), 25.0 * (j - 1), 0);
    }
  }
  return HSplineSurface(shape, net);
}

// Chords of the circle on triangles of an eighth of the radius or so, inside it.
TEST(TrimmedTessellation, OnePointOnAPlateLeavesADisc) {
  const std::vector<Vec3> points = {Vec3(40, 60, 0)};
  for (const double radius : {2.0, 20.0}) {
    const TrimmedTessellation t = TessellateNear(Plate(), 0.1, PointQuery(points), radius);
    const double disc = std::numbers::pi * radius * radius;
    EXPECT_LT(t.kept_mm2, disc);
    EXPECT_GT(t.kept_mm2, 0.985 * disc);
    EXPECT_NEAR(t.kept_mm2 + t.cut_mm2, 1e4, 1e-6);
    EXPECT_EQ(ConnectedComponents(t.kept.mesh).count, 1);
  }
}

TEST(TrimmedTessellation, AHoleInThePointsIsAHoleInTheSurface) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 50; ++i) {
    for (int j = 0; j <= 50; ++j) {
      if (const Vec3 p(2 * i, 2 * j, 0); (p - Vec3(50, 50, 0)).norm() > 20) {
        points.push_back(p);
      }
    }
  }
  const Tessellation t = TessellateNear(Plate(), 0.1, PointQuery(points), 4).kept;
  const EdgeReport edges = CheckEdges(t.mesh);
  const auto unique_edges = (3 * t.mesh.triangles.size() + edges.boundary) / 2;
  const auto euler = static_cast<long>(t.mesh.points.size()) - static_cast<long>(unique_edges) +
                     static_cast<long>(t.mesh.triangles.size());
  EXPECT_EQ(euler, 0);  // of a plate with one hole
  for (const Vec3& p : t.mesh.points) {
    EXPECT_GT((p - Vec3(50, 50, 0)).norm(), 15);
  }
}

// Detail beyond the distance costs no triangles, nor does what lies well within it.
TEST(TrimmedTessellation, OnlyTheBorderCostsTriangles) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 100; ++i) {
    for (int j = 0; j <= 50; ++j) {
      points.emplace_back(i, j, 0);
    }
  }
  const Tessellation t = TessellateNear(Plate(), 0.1, PointQuery(points), 2).kept;
  EXPECT_LT(t.mesh.triangles.size(),
            20'000);  // 100 mm of border in cells of 1/4 mm, and their neighbours
  EXPECT_GT(t.mesh.triangles.size(), 400);
}

TEST(TrimmedTessellation, RefusesDistancesThatCannotBe) {
  const std::vector<Vec3> points = {Vec3(40, 60, 0)}, far = {Vec3(0, 0, 50)};
  for (const double distance : {0.0, -1.0, kNaN, HUGE_VAL}) {
    EXPECT_THROW(TessellateNear(Plate(), 0.1, PointQuery(points), distance), InputError);
  }
  EXPECT_THROW(TessellateNear(Plate(), 0.1, PointQuery(far), 10), InputError);
  EXPECT_THROW(TessellateNear(Plate(), 0, PointQuery(points), 10), InputError);
}

}  // namespace
}  // namespace semblance
