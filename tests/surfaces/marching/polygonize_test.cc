// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/marching/polygonize.h"

#include <gtest/gtest.h>

#include <map>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/implicit_face.h"
#include "surfaces/marching/edge_intersections.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

SampleGrid CubeGrid(double half, int n) {
  return {Vec3::Constant(-half), Vec3::Constant(2 * half / (n - 1)), {n, n, n}};
}

double Ball(const Vec3& p) { return 10 - (p - Vec3(0.3, -0.2, 0.1)).norm(); }

// Negative on the grid's border.
std::vector<float> RandomSamples(const SampleGrid& grid, std::uint64_t random_seed) {
  Random random(random_seed);
  std::vector<float> samples(grid.CornerCount(), -1);
  for (int k = 1; k + 1 < grid.counts[2]; ++k) {
    for (int j = 1; j + 1 < grid.counts[1]; ++j) {
      for (int i = 1; i + 1 < grid.counts[0]; ++i) {
        samples[grid.Index(i, j, k)] = static_cast<float>(random.Uniform(-1, 1));
      }
    }
  }
  return samples;
}

TEST(Polygonize, EveryRandomFieldIsWatertightManifoldAndConsistent) {
  for (std::uint64_t random_seed = 0; random_seed < 1000; ++random_seed) {
    const SampleGrid grid = CubeGrid(1, 7);
    const PolygonizeResult result = PolygonizeSamples(RandomSamples(grid, random_seed), grid, {});
    const EdgeReport edges = CheckEdges(result.mesh);
    EXPECT_EQ(edges.boundary, 0) << random_seed;
    EXPECT_EQ(edges.non_manifold, 0) << random_seed;
    EXPECT_EQ(edges.inconsistent, 0) << random_seed;
    EXPECT_GT(SignedVolume(result.mesh), 0);
  }
}

TEST(Polygonize, ABallIsABall) {
  for (const EdgeSearch method : {EdgeSearch::kBisection, EdgeSearch::kRegulaFalsi}) {
    const PolygonizeResult result =
        PolygonizeAll(Ball, CubeGrid(12, 25), {.method = method, .tolerance = 1e-6}, {});
    for (const Vec3& p : result.mesh.points) {
      EXPECT_NEAR(Ball(p), 0, 1e-5);
    }
    EXPECT_NEAR(SignedVolume(result.mesh), 4.0 / 3 * std::numbers::pi * 1000, 40);
    EXPECT_FALSE(result.touches_border);
    EXPECT_EQ(CheckEdges(result.mesh).boundary, 0);
  }
}

TEST(Polygonize, RegulaFalsiNeedsFewerEvaluations) {
  const auto evaluations = [](EdgeSearch method) {
    return PolygonizeAll(Ball, CubeGrid(12, 25), {.method = method, .tolerance = 1e-4}, {})
        .summary.edge_evaluations;
  };
  EXPECT_LT(3 * evaluations(EdgeSearch::kRegulaFalsi), evaluations(EdgeSearch::kBisection));
}

// The error for a function that falls from positive at 0 to negative at 1, compared with 60
// bisections.
void ExpectCrossing(const std::function<double(double)>& field, double within,
                    std::int64_t& evaluations) {
  double low = 0, high = 1;
  for (int n = 0; n < 60; ++n) {
    const double middle = 0.5 * (low + high);
    (field(middle) > 0 ? low : high) = middle;
  }
  for (const double tolerance : {1e-2, 1e-3, 1e-5}) {
    const double at =
        SearchCrossing(field(0), field(1), {.tolerance = tolerance}, field, evaluations);
    EXPECT_NEAR(at, low, within * tolerance);
  }
}

// The tolerance is kept if the curve is convex or concave, and nearly kept at an inflection.
TEST(SearchCrossing, IsWithinTheToleranceOnSmoothCurves) {
  Random random(31);
  std::int64_t evaluations = 0;
  for (int n = 0; n < 3000; ++n) {
    const double at = random.Uniform(0.001, 0.999), bend = random.Uniform(-0.45, 0.45),
                 twist = n % 2 == 0 ? 0 : random.Uniform(-0.3, 0.3);
    const auto curve = [&](double t) {
      return (at - t) * (1 + bend * (t - at) + twist * (t - at) * (t - at));
    };
    ExpectCrossing(curve, twist == 0 ? 1 : 5, evaluations);
  }
  EXPECT_LT(evaluations, 3000 * 3 * 3);
}

// Convex or concave curves: a corner, a step that is cut off at one end, a power.
TEST(SearchCrossing, IsWithinTheToleranceHoweverSharpTheBend) {
  Random random(32);
  std::int64_t evaluations = 0;
  for (int n = 0; n < 2000; ++n) {
    const double at = random.Uniform(0.01, 0.99), corner = random.Uniform(0, 1),
                 steep = std::exp(random.Uniform(-2, 2));
    const auto bent = [&](double t) { return t < corner ? corner - t : steep * (corner - t); };
    ExpectCrossing([&](double t) { return bent(t) - bent(at); }, 1, evaluations);
    ExpectCrossing([&](double t) { return std::min(0.99, 30 * steep * (at - t)); }, 1, evaluations);
    ExpectCrossing([&](double t) { return std::pow(at, 6) - std::pow(t, 6); }, 1, evaluations);
  }
}

// The outermost cell that the surface crosses on the line through the middle.
StartCell StartOnLine(const ScalarField& field, const SampleGrid& grid) {
  int i = 0;
  while (!(field(grid.Corner(i + 1, 12, 12)) > 0)) {
    ++i;
  }
  return {grid.Index(i, 12, 12)};
}

TEST(Polygonize, ContinuationGivesTheMeshOfAllCells) {
  const SampleGrid grid = CubeGrid(12, 25);
  const PolygonizeResult all = PolygonizeAll(Ball, grid, {}, {});
  const PolygonizeResult from = PolygonizeFrom(Ball, grid, {{StartOnLine(Ball, grid)}}, {}, {});
  EXPECT_EQ(from.mesh.points, all.mesh.points);
  EXPECT_EQ(from.mesh.triangles, all.mesh.triangles);
  EXPECT_LT(from.summary.corner_evaluations, all.summary.corner_evaluations / 3);
}

// A ball with a hollow that comes within half a cell of its surface on one side, so that cells are
// crossed by both.
double HollowBall(const Vec3& p) {
  return std::min(Ball(p), (p - Vec3(-0.6, 0.1, 0.2)).norm() - 7.6);
}

TEST(Polygonize, ContinuationFollowsOneOfTwoSheetsInACell) {
  const SampleGrid grid = CubeGrid(12, 25);
  const PolygonizeResult all = PolygonizeAll(HollowBall, grid, {}, {});
  int dropped = 0;
  const TriMesh outer = KeepOutermost(all.mesh, dropped);
  ASSERT_EQ(dropped, 1);
  StartCell start = StartOnLine(HollowBall, grid);
  start.edges = EdgeBits(1 << EdgeFrom(0, 0));
  const PolygonizeResult from = PolygonizeFrom(HollowBall, grid, {{start}}, {}, {});
  EXPECT_EQ(from.mesh.points, outer.points);
  EXPECT_EQ(from.mesh.triangles, outer.triangles);
  const PolygonizeResult solid = PolygonizeFrom(Ball, grid, {{StartOnLine(Ball, grid)}}, {}, {});
  EXPECT_EQ(from.summary.active_cells, solid.summary.active_cells);
  EXPECT_EQ(from.summary.corner_evaluations, solid.summary.corner_evaluations);
}

// In random fields sheets share cells of all kinds.
TEST(Polygonize, ContinuationFromEachComponentGivesThatComponent) {
  for (std::uint64_t random_seed = 0; random_seed < 20; ++random_seed) {
    const SampleGrid grid = CubeGrid(1, 9);
    const std::vector<float> samples = RandomSamples(grid, random_seed);
    const ScalarField nearest = [&](const Vec3& p) {
      const Vec3 at = (p - grid.origin).cwiseQuotient(grid.cell_mm);
      return samples[grid.Index(static_cast<int>(std::lround(at.x())),
                                static_cast<int>(std::lround(at.y())),
                                static_cast<int>(std::lround(at.z())))];
    };
    const TriMesh all = PolygonizeAll(nearest, grid, {}, {}).mesh;
    std::map<std::vector<double>, std::size_t> triangles_of;  // by the points of a component
    for (std::int64_t corner = 0; corner < grid.CornerCount(); ++corner) {
      const auto [i, j, k] = grid.At(corner);
      if (i + 1 == grid.counts[0] || (samples[corner] > 0) == (samples[corner + 1] > 0)) {
        continue;
      }
      const StartCell start{corner, EdgeBits(1 << EdgeFrom(0, 0))};
      const TriMesh one = PolygonizeFrom(nearest, grid, {{start}}, {}, {}).mesh;
      ASSERT_EQ(ConnectedComponents(one).count, 1);
      std::vector<double> points;
      for (const Vec3& p : one.points) {
        points.insert(points.end(), p.begin(), p.end());
      }
      triangles_of[points] = one.triangles.size();
    }
    EXPECT_EQ(triangles_of.size(), ConnectedComponents(all).count);
    std::size_t followed = 0;
    for (const auto& [points, triangles] : triangles_of) {
      followed += triangles;
    }
    EXPECT_EQ(followed, all.triangles.size());
  }
}

TEST(Polygonize, ThreadsChangeNoBit) {
  RunContext two;
  two.threads = 2;
  const PolygonizeResult a = PolygonizeAll(Ball, CubeGrid(12, 20), {}, {}),
                         b = PolygonizeAll(Ball, CubeGrid(12, 20), {}, two);
  EXPECT_EQ(a.mesh.points, b.mesh.points);
  EXPECT_EQ(a.summary.edge_evaluations, b.summary.edge_evaluations);
}

TEST(Polygonize, ASurfaceThatLeavesTheGridIsOpenAndReported) {
  const PolygonizeResult result = PolygonizeAll(Ball, CubeGrid(9, 19), {}, {});
  EXPECT_TRUE(result.touches_border);
  EXPECT_GT(CheckEdges(result.mesh).boundary, 0);
}

TEST(Polygonize, RefusesAnInvalidGrid) {
  EXPECT_THROW(PolygonizeAll(Ball, SampleGrid{}, {}, {}), InputError);
  EXPECT_THROW(PolygonizeSamples(std::vector<float>(5), CubeGrid(1, 3), {}), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
