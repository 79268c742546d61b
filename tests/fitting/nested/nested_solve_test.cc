// SPDX-License-Identifier: GPL-3.0-or-later
// Conjugate gradients over all levels, against the direct solve of one level and the definitions.
#include "fitting/nested/nested_solve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

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
    std::vector<std::uint32_t> all(points.size());
    std::iota(all.begin(), all.end(), 0u);
    solve.Begin(space, all);
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

// Without smoothness and with points enough each vertex is determined: the trace counts them.
TEST(NestedSolve, TheTraceIsTheNumberOfVerticesWithoutSmoothness) {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 1};
  const HSplineSurface start = PlainStart(shape);
  const NestedPoints points = DisplacementsOf(start, Scattered(HeadPoint, 20000, 0, 4));
  const NestedSpace space(shape);
  NestedSolve solve(points, MeanLengths(start));
  std::vector<std::uint32_t> all(points.size());
  std::iota(all.begin(), all.end(), 0u);
  solve.Begin(space, all);
  solve.SetWeight(1e-14);
  solve.Solve(0);
  // One probe: the standard deviation is sqrt(2 * 121).
  EXPECT_NEAR(solve.Trace(), 121, 4 * std::sqrt(2 * 121));
}

}  // namespace
}  // namespace semblance
