// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/tessellate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "surfaces/base/error.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

using testing::RandomSurface;

class ChordLaws : public ::testing::TestWithParam<HSplineShape> {};

// The (u,v) of a triangle's corners; corners on a seam are moved next to the others.
std::array<Vec2, 3> Corners(const Tessellation& t, const Triangle& triangle) {
  std::array<Vec2, 3> uv = {t.uv[triangle[0]], t.uv[triangle[1]], t.uv[triangle[2]]};
  for (const int axis : {0, 1}) {
    const double last = std::max({uv[0][axis], uv[1][axis], uv[2][axis]}),
                 first = std::min({uv[0][axis], uv[1][axis], uv[2][axis]});
    for (Vec2& corner : uv) {
      corner[axis] += corner[axis] == 0 && last - first > 0.5 ? 1 : 0;
    }
  }
  return uv;
}

TEST_P(ChordLaws, NoTriangleIsFurtherFromTheSurfaceThanTheChord) {
  const HSplineSurface surface = RandomSurface(GetParam(), 1);
  std::size_t before = 0;
  for (const double chord : {1.0, 0.1, 0.02}) {
    const Tessellation t = TessellateToChord(surface, chord);
    EXPECT_GT(t.mesh.triangles.size(), before);
    before = t.mesh.triangles.size();
    double worst = 0;
    for (const Triangle& triangle : t.mesh.triangles) {
      const std::array<Vec2, 3> uv = Corners(t, triangle);
      for (const Vec3& w : {Vec3(1, 1, 1), Vec3(3, 3, 0), Vec3(0, 3, 3), Vec3(3, 0, 3)}) {
        const Vec3 weights = w / w.sum();
        const Vec3 flat = weights[0] * t.mesh.points[triangle[0]] +
                          weights[1] * t.mesh.points[triangle[1]] +
                          weights[2] * t.mesh.points[triangle[2]];
        const Vec2 place = weights[0] * uv[0] + weights[1] * uv[1] + weights[2] * uv[2];
        worst = std::max(worst, (surface.Point(place) - flat).norm());
      }
    }
    EXPECT_LE(worst, chord);
    EXPECT_GT(worst, chord / 20);  // not much finer than requested
  }
}

TEST_P(ChordLaws, IsWatertightAndFacesOutward) {
  const HSplineSurface surface = RandomSurface(GetParam(), 2);
  const Tessellation t = TessellateToChord(surface, 0.1);
  const EdgeReport edges = CheckEdges(t.mesh);
  EXPECT_EQ(edges.non_manifold + edges.inconsistent, 0);
  const bool open_u = !GetParam().ClosedU();
  std::int64_t border = 0;  // vertices on the domain's border: one edge each
  for (const Vec2& uv : t.uv) {
    border += uv.y() == 0 || uv.y() == 1 || (open_u && (uv.x() == 0 || uv.x() == 1));
  }
  EXPECT_EQ(edges.boundary, border);
  EXPECT_EQ(ConnectedComponents(t.mesh).count, 1);
  double area = 0;  // the domain is covered once
  for (const Triangle& triangle : t.mesh.triangles) {
    const std::array<Vec2, 3> uv = Corners(t, triangle);
    const Vec2 a = uv[1] - uv[0], b = uv[2] - uv[0];
    const double part = (a.x() * b.y() - a.y() * b.x()) / 2;
    EXPECT_GT(part, 0);
    area += part;
  }
  EXPECT_NEAR(area, 1, 1e-12);
}

TEST_P(ChordLaws, VerticesAndNormalsAreTheSurfaces) {
  const HSplineSurface surface = RandomSurface(GetParam(), 3);
  const Tessellation t = TessellateToChord(surface, 0.2);
  ASSERT_EQ(t.mesh.points.size(), t.uv.size());
  for (std::size_t k = 0; k < t.uv.size(); k += 7) {
    EXPECT_LT((t.mesh.points[k] - surface.Point(t.uv[k])).norm(), 1e-11);
    EXPECT_LT((t.normals[k] - surface.Normal(t.uv[k])).norm(), 1e-11);
  }
  EXPECT_EQ(TessellateToChord(surface, 0.2, 3).mesh.points, t.mesh.points);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, ChordLaws,
    ::testing::Values(HSplineShape{.patches_u = 4, .patches_v = 5, .max_level = 2},
                      HSplineShape{.patches_u = 1, .patches_v = 1, .max_level = 5},
                      HSplineShape{.patches_u = 5,
                                   .patches_v = 4,
                                   .max_level = 2,
                                   .closure = Closure::kPeriodicU}));

TEST(AdaptiveTessellation, ACellIsNoMoreThanTwiceItsNeighbourAcrossASeam) {
  const HSplineShape shape{
      .patches_u = 8, .patches_v = 8, .max_level = 6, .closure = Closure::kPeriodicU};
  HSplineSurface surface = testing::SmoothSurface(shape, 1);
  surface.SetOffsets({{{6, 1, 300}, Vec3(0, 0, 2)}});  // at u = 0
  const Tessellation t = TessellateToChord(surface, 0.5);
  const EdgeReport edges = CheckEdges(t.mesh);
  EXPECT_EQ(edges.non_manifold + edges.inconsistent, 0);
  EXPECT_EQ(edges.boundary,
            std::ranges::count_if(t.uv, [](const Vec2& uv) { return uv.y() == 0 || uv.y() == 1; }));
}

TEST(AdaptiveTessellation, DetailCostsTrianglesOnlyWhereItIs) {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 6};
  HSplineSurface surface = testing::SmoothSurface(shape, 1);
  const std::size_t smooth = TessellateToChord(surface, 0.1).mesh.triangles.size();
  surface.SetOffsets({{{6, 101, 101}, Vec3(0, 0, 2)}});
  EXPECT_LT(TessellateToChord(surface, 0.1).mesh.triangles.size(), smooth + 2000);
}

// Balancing may add cells. A cell has two triangles, or up to eight next to finer cells.
TEST_P(ChordLaws, CellsAreCountedBeforeTheyAreMade) {
  const HSplineSurface surface = RandomSurface(GetParam(), 4);
  double before = 0;
  for (const double chord : {10.0, 1.0, 0.1, 0.02}) {
    const double cells = CellsToChord(surface, chord);
    const auto triangles =
        static_cast<double>(TessellateToChord(surface, chord).mesh.triangles.size());
    EXPECT_GE(triangles, 2 * cells);
    EXPECT_LE(triangles, 16 * cells);
    EXPECT_GE(cells, before);
    before = cells;
  }
  EXPECT_GT(CellsToChord(surface, 1e-9), 1e7);
  EXPECT_THROW(TessellateToChord(surface, 1e-9), InputError);
}

TEST(AdaptiveTessellation, InvalidChordsAreRefused) {
  const HSplineSurface surface = testing::SmoothSurface({.max_level = 1}, 1);
  EXPECT_THROW(TessellateToChord(surface, 0), InputError);
  EXPECT_THROW(TessellateToChord(surface, kNaN), InputError);
  EXPECT_THROW(TessellateToChord(surface, 1e-15), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
