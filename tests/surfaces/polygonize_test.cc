// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/polygonize.h"

#include <gtest/gtest.h>

#include "surfaces/error.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using testing::Random;

SampleGrid CubeGrid(double half, int n) {
  return {Vec3::Constant(-half), Vec3::Constant(2 * half / (n - 1)), {n, n, n}};
}

double Ball(const Vec3& p) { return 10 - (p - Vec3(0.3, -0.2, 0.1)).norm(); }

TEST(Polygonize, EveryRandomFieldIsWatertightManifoldAndConsistent) {
  for (std::uint64_t random_seed = 0; random_seed < 1000; ++random_seed) {
    Random random(random_seed);
    const SampleGrid grid = CubeGrid(1, 7);
    std::vector<float> samples(grid.CornerCount(), -1);
    for (int k = 1; k < 6; ++k) {
      for (int j = 1; j < 6; ++j) {
        for (int i = 1; i < 6; ++i) {
          samples[grid.Index(i, j, k)] = static_cast<float>(random.Uniform(-1, 1));
        }
      }
    }
    const PolygonizeResult result = PolygonizeSamples(samples, grid, {});
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

TEST(Polygonize, ContinuationGivesTheMeshOfAllCells) {
  const SampleGrid grid = CubeGrid(12, 25);
  const PolygonizeResult all = PolygonizeAll(Ball, grid, {}, {});
  // The cell that the surface crosses on the line through the ball's middle.
  std::vector<std::int64_t> seeds;
  for (int i = 0; i + 1 < 25; ++i) {
    if ((Ball(grid.Corner(i, 12, 12)) > 0) != (Ball(grid.Corner(i + 1, 12, 12)) > 0)) {
      seeds.push_back(grid.Index(i, 12, 12));
      break;
    }
  }
  const PolygonizeResult from = PolygonizeFrom(Ball, grid, seeds, {}, {});
  EXPECT_EQ(from.mesh.points, all.mesh.points);
  EXPECT_EQ(from.mesh.triangles, all.mesh.triangles);
  EXPECT_LT(from.summary.corner_evaluations, all.summary.corner_evaluations / 3);
}

TEST(Polygonize, ThreadsChangeNoBit) {
  RunContext two;
  two.threads = 2;
  const PolygonizeResult a = PolygonizeAll(Ball, CubeGrid(12, 20), {}, {}),
                         b = PolygonizeAll(Ball, CubeGrid(12, 20), {}, two);
  EXPECT_EQ(a.mesh.points, b.mesh.points);
  EXPECT_EQ(a.summary.edge_evaluations, b.summary.edge_evaluations);
}

TEST(Polygonize, ASurfaceThatLeavesTheGridIsOpenAndSaidToBe) {
  const PolygonizeResult result = PolygonizeAll(Ball, CubeGrid(9, 19), {}, {});
  EXPECT_TRUE(result.touches_border);
  EXPECT_GT(CheckEdges(result.mesh).boundary, 0);
}

TEST(Polygonize, RefusesAGridThatIsNone) {
  EXPECT_THROW(PolygonizeAll(Ball, SampleGrid{}, {}, {}), InputError);
  EXPECT_THROW(PolygonizeSamples(std::vector<float>(5), CubeGrid(1, 3), {}), InputError);
}

}  // namespace
}  // namespace semblance
