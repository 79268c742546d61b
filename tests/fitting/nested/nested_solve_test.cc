// SPDX-License-Identifier: GPL-3.0-or-later
// Compares conjugate gradients over all levels with the direct solve of one level and with the
// definitions.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fitting/nested/nested_solve.h"
#include "fitting/solve/space_solve.h"
#include "surfaces/base/random.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using testing::HeadPoint;
using testing::PlainStart;
using testing::Scattered;

constexpr Closure kClosures[] = {Closure::kOpen, Closure::kPeriodicU};

NestedPoints DisplacementsOf(const HSplineSurface& start, const FitTarget& target) {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
  }
  return DisplacementsFrom(start, {positions, uv}, 1);
}

GridLayout Layout(Closure closure) {
  return {PatchGrid::Of({.patches_u = 8, .patches_v = 5, .closure = closure}, 0)};
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
  for (const Closure closure : kClosures) {
    const GridLayout coarse = Layout(closure), fine = coarse.Finer();
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
  for (const Closure closure : kClosures) {
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

// Some patches, apart from each other and across the seam.
std::vector<char> SomePatches(const GridLayout& layout) {
  std::vector<char> some(layout.Patches(), 0);
  for (const auto& [i, j] :
       {std::array{0, 0}, std::array{7, 0}, std::array{3, 2}, std::array{4, 2}, std::array{7, 4}}) {
    some[layout.Patch(i, j)] = 1;
  }
  return some;
}

TEST(NestedSolve, RunsHoldEachVertexOfThePatchesOnce) {
  for (const Closure closure : kClosures) {
    const GridLayout layout = Layout(closure).Finer().Finer();  // rows of several runs
    std::vector<char> patches(layout.Patches(), 0);
    for (const int i : {0, 1, 13, 31}) {
      patches[layout.Patch(i, 5)] = patches[layout.Patch(i, 19)] = 1;
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
      for (const int j : {5, 19}) {
        for (const int vertex : layout.grid.PatchVertices(i, j)) {
          EXPECT_EQ(held[layout.At(vertex % layout.grid.Columns(), vertex / layout.grid.Columns())],
                    1);
        }
      }
    }
  }
}

// By definition, the product is the sum of the patches' products.
TEST(NestedSolve, AStencilProductIsTheSumOfPatchProducts) {
  for (const Closure closure : kClosures) {
    const GridLayout layout = Layout(closure);
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

// With all vertices of level 1 active the space is level 1 as a plain B-spline, which a direct
// factor solves.
class NestedSolveIn : public ::testing::TestWithParam<double> {};  // a stretch of lengths
INSTANTIATE_TEST_SUITE_P(Lengths, NestedSolveIn, ::testing::Values(1.0, 2.5));

TEST_P(NestedSolveIn, EqualsTheDirectSolveOfALevel) {
  const BendingStretch stretch{.stretch = GetParam(), .direction_deg = 30};
  for (const Closure closure : kClosures) {
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
    solve.Begin(space, {}, MakeBendingMetric(stretch));
    solve.SetWeight(kWeight);
    solve.Solve(0);
    const std::vector<Term> terms = {PointTerm{},
                                     SmoothnessTerm{.weight = kWeight,
                                                    .length_mm = 1,
                                                    .stretch = stretch.stretch,
                                                    .direction_deg = stretch.direction_deg}};
    const LevelSolution direct =
        FitLevel(MakeLevelView(start, start, target, 1, {.aim = FitAim::kLevel, .held = {}}), terms,
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

// After a change of the metric the solve equals one that began with it.
TEST(NestedSolve, TheMetricMayChange) {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 0};
  const HSplineSurface start = PlainStart(shape);
  const NestedPoints points = DisplacementsOf(start, Scattered(HeadPoint, 1000, 0.01, 4));
  const NestedSpace space(shape);
  const BendingMetric metric = MakeBendingMetric({.stretch = 3, .direction_deg = 120});
  NestedSolve changed(points, MeanLengths(start)), at_once(points, MeanLengths(start));
  changed.Begin(space, {});
  changed.SetWeight(1e-4);
  changed.Solve(0);
  changed.SetMetric(metric);
  changed.Solve(0);
  at_once.Begin(space, {}, metric);
  at_once.SetWeight(1e-4);
  at_once.Solve(0);
  const NestedSolve::Packed a = changed.Solution(), b = at_once.Solution();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_NEAR(a[k], b[k], 1e-5);
  }
  const BendingSums one = changed.Bending(), other = at_once.Bending();
  EXPECT_GT(one[0], 0);
  for (std::size_t k = 0; k < one.size(); ++k) {
    EXPECT_NEAR(one[k], other[k], 1e-4 * (one[0] + one[2]));
  }
}

// The B-spline of a vertex of a closed direction at x patches, by definition.
double Around(double x, int vertex, int patches, int order) {
  double sum = 0;
  for (const int turn : {-1, 0, 1}) {
    sum += testing::CubicBSpline(x - (vertex + turn * patches) + 3, order);
  }
  return sum * std::pow(patches, order);
}

// The B-spline of a vertex of an open direction.
double Along(double x, int vertex, int patches, int order) {
  return testing::CubicBSpline(x - vertex + 3, order) * std::pow(patches, order);
}

// The B-splines of all vertices of a tube, or their derivatives, as a row.
Eigen::RowVectorXd TubeRow(const HSplineShape& shape, const Vec2& uv, DerivativeOrder order) {
  const int m = shape.patches_u, n = shape.patches_v;
  Eigen::RowVectorXd row(m * shape.Rows(0));
  for (int k = 0; k < row.size(); ++k) {
    row[k] = Around(uv.x() * m, k % m, m, order.u) * Along(uv.y() * n, k / m, n, order.v);
  }
  return row;
}

// The mean over the domain of |S_ss|^2 + 2 |S_st|^2 + |S_tt|^2, s and t in mm, by four Gauss points
// a patch each way, which are exact.
Eigen::MatrixXd TubeEnergy(const HSplineShape& shape, const Vec2& lengths_mm) {
  constexpr std::array<std::array<double, 2>, 4> kGauss = {
      {{0.06943184420297371, 0.1739274225687269},
       {0.33000947820757187, 0.3260725774312731},
       {0.6699905217924281, 0.3260725774312731},
       {0.9305681557970263, 0.1739274225687269}}};
  const int m = shape.patches_u, n = shape.patches_v;
  const int vertices = m * shape.Rows(0);
  Eigen::MatrixXd energy = Eigen::MatrixXd::Zero(vertices, vertices);
  for (int k = 0; k < 16 * m * n; ++k) {
    const auto& [s, weight_s] = kGauss[k % 4];
    const auto& [t, weight_t] = kGauss[k / 4 % 4];
    const Vec2 uv((k / 16 % m + s) / m, (k / 16 / m + t) / n);
    const double share = weight_s * weight_t / (m * n);
    for (const auto& [order, factor] : {std::pair{DerivativeOrder{2, 0}, 1.0},
                                        {DerivativeOrder{1, 1}, 2.0},
                                        {DerivativeOrder{0, 2}, 1.0}}) {
      const Eigen::RowVectorXd row =
          TubeRow(shape, uv, order) /
          (std::pow(lengths_mm.x(), order.u) * std::pow(lengths_mm.y(), order.v));
      energy += factor * share * row.transpose() * row;
    }
  }
  return energy;
}

TEST(NestedSolve, OnATubeItIsDenseLeastSquares) {
  const HSplineShape shape{
      .patches_u = 5, .patches_v = 4, .max_level = 0, .closure = Closure::kPeriodicU};
  const HSplineSurface start = PlainStart(shape);
  const FitTarget target = Scattered(HeadPoint, 300, 0.01, 4);
  const NestedPoints points = DisplacementsOf(start, target);
  const NestedSpace space(shape);
  constexpr double kWeight = 1e-4;
  NestedSolve solve(points, MeanLengths(start));
  solve.Begin(space, {});
  solve.SetWeight(kWeight);
  solve.Solve(0);
  Eigen::MatrixXd rows(300, 35);
  Eigen::MatrixX3d moved(300, 3);
  for (int k = 0; k < 300; ++k) {
    rows.row(k) = TubeRow(shape, target.points[k].uv, {});
    moved.row(k) = (target.points[k].position - start.Point(target.points[k].uv)).transpose();
  }
  const Eigen::MatrixXd normal =
      rows.transpose() * rows + 300 * kWeight * TubeEnergy(shape, MeanLengths(start));
  const Eigen::MatrixX3d dense = normal.ldlt().solve(rows.transpose() * moved);
  const NestedValues& displacements = solve.Displacements();
  for (int k = 0; k < 35; ++k) {
    Vec3 found = Vec3::Zero();
    for (int c = 0; c < points.channels; ++c) {
      found += displacements[0].Row(c, k / 5)[k % 5] * points.axes.col(c);
    }
    EXPECT_LT((found - dense.row(k).transpose()).norm(), 1e-7) << k;
  }
}

TEST(NestedSolve, TheMeanSquareIsThatOfTheResiduals) {
  for (const Closure closure : kClosures) {
    const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 2, .closure = closure};
    const HSplineSurface start = PlainStart(shape);
    const NestedPoints points = DisplacementsOf(start, Scattered(HeadPoint, 3000, 0.01, 4));
    NestedSpace space(shape);
    for (const auto& [i, j] : {std::array{7, 3}, std::array{0, 3}, std::array{5, 7}}) {
      space.Overlay(0, i, j);
    }
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
      for (const NestedResidual& residual : solve.Residuals(used)) {
        sum += residual.Square();
      }
      const double expected = sum / static_cast<double>(used.Count(points)) / points.channels;
      EXPECT_NEAR(solve.MeanSquare(), expected, 1e-9 * expected);
    }
  }
}

TEST(NestedSolve, ASolutionCanBeRestored) {
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
  EXPECT_GT(solve.Residuals({})[7].Square(), 0);
  solve.SetSolution(packed);
  EXPECT_EQ(solve.Solution(), packed);
  double sum = 0;
  for (const NestedResidual& residual : solve.Residuals({})) {
    sum += residual.Square();
  }
  EXPECT_NEAR(sum / 500 / points.channels, before, 1e-9 * before);
}

// Without smoothness and with enough points each vertex is determined, and the trace counts the
// vertices.
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
}  // namespace semblance::fitting
