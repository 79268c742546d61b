// SPDX-License-Identifier: GPL-3.0-or-later
// Conjugate gradients over all levels, against the direct solve of one level and the definitions.
#include "fitting/nested/nested_solve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "fitting/solve/level_fit.h"
#include "surfaces/base/random.h"
#include "tests/testing/scattered_data.h"

namespace semblance {
namespace {

using testing::HeadPoint;
using testing::PlainStart;
using testing::Scattered;

NestedPoints DisplacementsOf(const HSplineSurface& start, const FitTarget& target) {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
  }
  return DisplacementsFrom(start, {positions, uv}, 1);
}

GridLayout Layout(bool periodic) {
  return {{.patches_u = 8, .patches_v = 5, .periodic_u = periodic}};
}

GridValues RandomValues(const GridLayout& layout, std::uint64_t seed) {
  Random random(seed);
  GridValues values(layout, 2);
  for (int c = 0; c < 2; ++c) {
    for (int j = 0; j < layout.grid.Rows(); ++j) {
      for (int i = 0; i < layout.grid.Columns(); ++i) {
        values.Row(c, j)[i] = random.Uniform(-1, 1);
      }
    }
  }
  return values;
}

GridRuns AllOf(const GridLayout& layout) {
  return RunsAround(layout, std::vector<char>(layout.Patches(), 1));
}

double Product(const GridValues& a, const GridValues& b) {
  double sum = 0;
  for (int j = 0; j < a.layout().grid.Rows(); ++j) {
    for (int i = 0; i < a.layout().grid.Columns(); ++i) {
      sum += a.Row(0, j)[i] * b.Row(0, j)[i] + a.Row(1, j)[i] * b.Row(1, j)[i];
    }
  }
  return sum;
}

TEST(NestedSolve, RestrictionIsTheTransposeOfRefinement) {
  for (const bool periodic : {false, true}) {
    const GridLayout coarse = Layout(periodic), fine = coarse.Finer();
    GridValues x = RandomValues(coarse, 1), y = RandomValues(fine, 2);
    const GridRuns all = AllOf(fine);
    x.FillHalo(AllOf(coarse));
    GridValues refined(fine, 2), restricted(coarse, 2);
    AddRefined(x, all, refined);
    AddRestricted(y, all, restricted);
    restricted.FoldHalo(AllOf(coarse));
    EXPECT_NEAR(Product(refined, y), Product(x, restricted), 1e-10);
  }
}

TEST(NestedSolve, RefinementIsThatOfTheSurface) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const HSplineShape shape{.patches_u = 8, .patches_v = 5, .max_level = 1, .closure = closure};
    const GridLayout coarse = {PatchGrid::Of(shape, 0)};
    GridValues x = RandomValues(coarse, 3);
    ControlNet net{shape.Columns(0), shape.Rows(0), {}};
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        net.vertices.emplace_back(x.Row(0, j)[i], x.Row(1, j)[i], 0);
      }
    }
    x.FillHalo(AllOf(coarse));
    GridValues fine(coarse.Finer(), 2);
    AddRefined(x, AllOf(coarse.Finer()), fine);
    const ControlNet expected = Refine(shape, net, 0);
    for (int j = 0; j < expected.rows; ++j) {
      for (int i = 0; i < expected.columns; ++i) {
        EXPECT_NEAR(fine.Row(0, j)[i], expected.At(i, j).x(), 1e-14);
        EXPECT_NEAR(fine.Row(1, j)[i], expected.At(i, j).y(), 1e-14);
      }
    }
  }
}

// Some of the patches, apart from each other and across the seam.
std::vector<char> SomePatches(const GridLayout& layout) {
  std::vector<char> some(layout.Patches(), 0);
  for (const auto& [i, j] :
       {std::array{0, 0}, std::array{7, 0}, std::array{3, 2}, std::array{4, 2}, std::array{7, 4}}) {
    some[layout.Patch(i, j)] = 1;
  }
  return some;
}

TEST(NestedSolve, RunsHoldEachVertexOfThePatchesOnce) {
  for (const bool periodic : {false, true}) {
    const GridLayout layout = Layout(periodic).Finer().Finer();  // rows of several runs
    std::vector<char> patches(layout.Patches(), 0);
    for (const int i : {0, 1, 13, 31}) {
      patches[layout.Patch(i, 5)] = 1;
    }
    std::vector<int> held(layout.Size(), 0);
    for (const GridRun& run : RunsAround(layout, patches)) {
      EXPECT_EQ(run.at, layout.At(run.begin, run.row));
      for (int k = 0; k < run.size(); ++k) {
        ++held[run.at + k];
      }
    }
    EXPECT_LE(*std::max_element(held.begin(), held.end()), 1);
    for (const int i : {0, 1, 13, 31}) {
      for (const int vertex : layout.grid.PatchVertices(i, 5)) {
        EXPECT_EQ(held[layout.At(vertex % layout.grid.Columns(), vertex / layout.grid.Columns())],
                  1);
      }
    }
  }
}

// The definition: the sum of the patches' products.
TEST(NestedSolve, AStencilsProductIsTheSumOfThoseOfThePatches) {
  for (const bool periodic : {false, true}) {
    const GridLayout layout = Layout(periodic);
    const std::vector<char> patches = SomePatches(layout);
    const GridRuns runs = RunsAround(layout, patches);
    StencilMatrix matrix(layout, runs);
    GridValues x = RandomValues(layout, 5), product(layout, 2);
    std::vector<double> expected(layout.grid.Columns() * layout.grid.Rows(), 0);
    const Matrix16 root = Matrix16::Random(), form = root * root.transpose();
    const auto at = [&](GridValues& values, int vertex) -> double& {
      return values.Row(1, vertex / layout.grid.Columns())[vertex % layout.grid.Columns()];
    };
    for (int patch = 0; patch < static_cast<int>(layout.Patches()); ++patch) {
      if (patches[patch] != 0) {
        const int i = patch % layout.grid.patches_u, j = patch / layout.grid.patches_u;
        matrix.AddPatch(i, j, form);
        const std::array<int, 16> vertices = layout.grid.PatchVertices(i, j);
        for (int k = 0; k < 16; ++k) {
          for (int l = 0; l < 16; ++l) {
            expected[vertices[k]] += form(k, l) * at(x, vertices[l]);
          }
        }
      }
    }
    x.FillHalo(AllOf(layout));
    matrix.AddProduct(x, product);
    product.FoldHalo(runs);
    for (int vertex = 0; vertex < std::ssize(expected); ++vertex) {
      EXPECT_NEAR(at(product, vertex), expected[vertex], 1e-10) << vertex;
    }
  }
}

// All vertices of level 1 overlaid is level 1 as a plain B-spline, which a direct factor solves.
TEST(NestedSolve, ALevelComesOutAsByADirectFactor) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 1, .closure = closure};
    const HSplineSurface start = PlainStart(shape);
    const FitTarget target = Scattered(HeadPoint, 1000, 0.01, 4);
    const NestedPoints points = DisplacementsOf(start, target);
    NestedSpace space(shape);
    for (int patch = 0; patch < 64; ++patch) {
      space.Overlay(0, patch % 8, patch / 8);
    }
    space.Link();
    constexpr double kWeight = 1e-5;
    NestedSolve solve(points, MeanLengths(start));
    solve.Begin(space, {});
    solve.SetWeight(kWeight);
    solve.Solve(0);
    const std::vector<Term> terms = {PointTerm{},
                                     SmoothnessTerm{.weight = kWeight, .length_mm = 1}};
    const LevelSolution direct =
        FitLevel(ViewOfLevel(start, start, target, 1, {.aim = FitAim::kLevel, .held = {}}), terms,
                 Solver::kFastest);
    const NestedValues& displacements = solve.Displacements();
    const ControlNet net = start.Net(1);
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        Vec3 moved = net.At(i, j);
        for (int c = 0; c < points.channels; ++c) {
          moved += displacements[1].Row(c, j)[i] * points.axes.col(c);
        }
        EXPECT_LT((moved - direct.net.At(i, j)).norm(), 1e-4) << i << " " << j;
      }
    }
  }
}

TEST(NestedSolve, TheMeanSquareIsThatOfTheResiduals) {
  const HSplineShape shape{
      .patches_u = 8, .patches_v = 8, .max_level = 2, .closure = Closure::kPeriodicU};
  const HSplineSurface start = PlainStart(shape);
  const NestedPoints points = DisplacementsOf(start, Scattered(HeadPoint, 3000, 0.01, 4));
  NestedSpace space(shape);
  space.Overlay(0, 7, 3);
  space.Overlay(0, 0, 3);
  space.Link();
  NestedSolve solve(points, MeanLengths(start));
  PointChoice used{.every = 2, .left_out = std::vector<char>(points.size(), 0)};
  for (std::size_t k = 0; k < points.size(); k += 14) {
    used.left_out[k] = 1;
  }
  solve.Begin(space, used);
  for (const double weight : {1e-3, 1e-7}) {
    solve.SetWeight(weight);
    solve.Solve(1e-6);
    double sum = 0;
    for (const NestedResidual& residual : solve.ResidualsOf(used)) {
      sum += residual.Square();
    }
    const double expected = sum / static_cast<double>(used.Count(points)) / points.channels;
    EXPECT_NEAR(solve.MeanSquare(), expected, 1e-9 * expected);
  }
}

TEST(NestedSolve, ASolutionComesBackAsItWas) {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 1};
  const HSplineSurface start = PlainStart(shape);
  const NestedPoints points = DisplacementsOf(start, Scattered(HeadPoint, 500, 0, 4));
  NestedSpace space(shape);
  space.Overlay(0, 2, 3);
  space.Link();
  NestedSolve solve(points, MeanLengths(start));
  solve.Begin(space, {});
  solve.SetWeight(1e-5);
  solve.Solve(0);
  const NestedSolve::Packed packed = solve.Solution();
  const double before = solve.MeanSquare();
  solve.SetWeight(10);
  solve.Solve(0);
  EXPECT_GT(solve.ResidualsOf({})[7].Square(), 0);
  solve.SetSolution(packed);
  EXPECT_EQ(solve.Solution(), packed);
  double sum = 0;
  for (const NestedResidual& residual : solve.ResidualsOf({})) {
    sum += residual.Square();
  }
  EXPECT_NEAR(sum / 500 / points.channels, before, 1e-9 * before);
}

// Without smoothness and with points enough each vertex is determined: the trace counts them.
TEST(NestedSolve, TheTraceIsTheNumberOfVerticesWithoutSmoothness) {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 1};
  const HSplineSurface start = PlainStart(shape);
  const NestedPoints points = DisplacementsOf(start, Scattered(HeadPoint, 20000, 0, 4));
  const NestedSpace space(shape);
  NestedSolve solve(points, MeanLengths(start));
  solve.Begin(space, {});
  solve.SetWeight(1e-14);
  solve.Solve(0);
  // One probe: the standard deviation is sqrt(2 * 121).
  EXPECT_NEAR(solve.Trace(), 121, 4 * std::sqrt(2 * 121));
}

}  // namespace
}  // namespace semblance
