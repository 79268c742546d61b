// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "fitting/least_squares/qr_compression.h"
#include "fitting/solve/space_solve.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/level_views.h"

namespace semblance::fitting {
namespace {

using testing::AllTerms;
using ::testing::HasSubstr;
using testing::LargestMove;
using testing::NoisyView;
using testing::Observe;
using testing::PlainStencil;
using testing::SameBytes;
using testing::Sheet;
using testing::View;

TEST(ScheduleStep, ReproducesASurfaceOfTheSpace) {
  const ControlNet truth = Sheet(6, 5, 3, 4);
  std::vector<Observation> lattice;
  for (int k = 0; k < 31 * 31; ++k) {
    const Vec2 uv = Vec2(k % 31, k / 31) / 30;
    lattice.push_back({.uv = uv, .position = PlainStencil(6, 5, uv).Apply(truth)});
  }
  const LevelView view = View(Sheet(6, 5, 0, 0), lattice);
  const LevelSolution solution = FitLevel(view, std::vector<Term>{PointTerm{}});
  EXPECT_LT(LargestMove(solution.net, truth), 1e-9);
  EXPECT_LT(solution.summary.rms_after_mm, 1e-10);
  EXPECT_TRUE(solution.summary.usable) << solution.summary.termination;
  EXPECT_EQ(solution.summary.uncovered_vertices, 0);
  EXPECT_EQ(solution.summary.rank, static_cast<int>(truth.vertices.size()));
}

// The oracle uses rows by the definitions of the terms (smoothness by quadrature of second
// derivatives), dense least squares.
struct DenseSystem {
  Eigen::MatrixXd a, b;
  void Add(const Stencil& s, double factor, const Vec3& value, int vertices) {
    a.conservativeResize(a.rows() + 1, vertices);
    b.conservativeResize(b.rows() + 1, 3);
    a.row(a.rows() - 1).setZero();
    for (int k = 0; k < 16; ++k) {
      a(a.rows() - 1, s.index[k]) += factor * s.weight[k];
    }
    b.row(b.rows() - 1) = factor * value.transpose();
  }
};

void AddPoints(const LevelView& view, DenseSystem& dense) {
  double sum = 0;
  for (const Observation& o : view.observations) {
    sum += o.weight;
  }
  for (const Observation& o : view.observations) {
    dense.Add(view.grid.StencilAt(o.uv), std::sqrt(o.weight / sum), o.position,
              static_cast<int>(view.start.vertices.size()));
  }
}

void AddThinPlate(const LevelView& view, const SmoothnessTerm& term, DenseSystem& dense) {
  const double node[] = {0.5 - std::sqrt(3.0 / 7 + 2.0 / 7 * std::sqrt(1.2)) / 2,
                         0.5 - std::sqrt(3.0 / 7 - 2.0 / 7 * std::sqrt(1.2)) / 2,
                         0.5 + std::sqrt(3.0 / 7 - 2.0 / 7 * std::sqrt(1.2)) / 2,
                         0.5 + std::sqrt(3.0 / 7 + 2.0 / 7 * std::sqrt(1.2)) / 2};
  const double outer = (18 - std::sqrt(30)) / 72, inner = (18 + std::sqrt(30)) / 72;
  const double weight[] = {outer, inner, inner, outer};
  const int m = view.grid.patches_u, n = view.grid.patches_v;
  const double lu = view.lengths_mm.x(), lv = view.lengths_mm.y();
  const int count = static_cast<int>(view.start.vertices.size());
  for (int q = 0; q < 16 * m * n; ++q) {
    const int a = q % 4, b = q / 4 % 4, i = q / 16 % m, j = q / 16 / m;
    const Vec2 uv((i + node[a]) / m, (j + node[b]) / n);
    const double f =
        std::pow(term.length_mm, 2) * std::sqrt(term.weight * weight[a] * weight[b] / (m * n));
    for (const auto& [du, dv, factor] :
         {std::tuple(2, 0, 1 / (lu * lu)), std::tuple(1, 1, std::sqrt(2.0) / (lu * lv)),
          std::tuple(0, 2, 1 / (lv * lv))}) {
      const Stencil s = PlainStencil(m, n, uv, du, dv);
      dense.Add(s, f * factor, s.Apply(view.rest), count);
    }
  }
}

TEST(ScheduleStep, EqualsDenseLeastSquares) {
  const LevelView view = NoisyView();
  const SmoothnessTerm smoothness{.weight = 0.05};
  const PriorTerm prior{.weight = 0.02};
  DenseSystem dense;
  AddPoints(view, dense);
  AddThinPlate(view, smoothness, dense);
  const int count = static_cast<int>(view.start.vertices.size());
  for (int k = 0; k < count; ++k) {
    Stencil s{};
    s.index[0] = k;
    s.weight[0] = 1;
    dense.Add(s, std::sqrt(prior.weight / count), view.start.vertices[k], count);
  }
  const Eigen::MatrixXd x = dense.a.colPivHouseholderQr().solve(dense.b);
  const LevelSolution solution = FitLevel(view, std::vector<Term>{PointTerm{}, smoothness, prior});
  for (int k = 0; k < count; ++k) {
    EXPECT_LT((solution.net.vertices[k] - x.row(k).transpose()).norm(), 1e-8);
  }
}

TEST(ScheduleStep, TakesTheNearestOfManySolutions) {
  const ControlNet start = Sheet(6, 5, 0, 0);
  const LevelView view = View(start, Observe(Sheet(6, 5, 4, 6), 9, 7));
  DenseSystem dense;
  AddPoints(view, dense);
  Eigen::MatrixXd x0(start.vertices.size(), 3);
  for (std::size_t k = 0; k < start.vertices.size(); ++k) {
    x0.row(k) = start.vertices[k];
  }
  const Eigen::MatrixXd move =
      dense.a.completeOrthogonalDecomposition().solve(dense.b - dense.a * x0);
  const LevelSolution solution = FitLevel(view, std::vector<Term>{PointTerm{}});
  for (std::size_t k = 0; k < start.vertices.size(); ++k) {
    EXPECT_LT((solution.net.vertices[k] - start.vertices[k] - move.row(k).transpose()).norm(),
              1e-5);
  }
  EXPECT_EQ(solution.summary.rank, 9);
  EXPECT_LT(solution.summary.rms_after_mm, 1e-7);
}

TEST(ScheduleStep, CoverageCountsThePointsOfEachPatch) {
  const PatchCoverage odd = MakeCoverage({0, 4, 1, 0, 9}), even = MakeCoverage({3, 0, 8});
  EXPECT_EQ(odd.patches, 5);
  EXPECT_EQ(odd.empty_patches, 2);
  EXPECT_EQ(odd.median_patch_points, 4);
  EXPECT_EQ(even.median_patch_points, 5.5);
  EXPECT_TRUE(std::isnan(MakeCoverage({0, 0}).median_patch_points));
}

TEST(ScheduleStep, VerticesWithoutAnyTermKeepTheirBits) {
  const ControlNet start = Sheet(8, 3, 1, 8);
  const LevelView view = View(start, Observe(Sheet(8, 3, 4, 9), 60, 10, 0, 0.49));  // patches 0..3
  const LevelSolution solution = FitLevel(view, std::vector<Term>{PointTerm{}});
  int moved = 0;
  for (int j = 0; j < start.rows; ++j) {
    for (int i = 0; i < start.columns; ++i) {
      const bool touched = i < 7;
      EXPECT_TRUE(touched || solution.net.At(i, j) == start.At(i, j));
      moved += solution.net.At(i, j) == start.At(i, j) ? 0 : 1;
    }
  }
  EXPECT_EQ(moved, 7 * start.rows);
  EXPECT_EQ(solution.summary.free_vertices, 7 * start.rows);
  EXPECT_EQ(solution.summary.uncovered_vertices, 4 * start.rows);
  EXPECT_EQ(solution.summary.coverage.patches, 8 * 3);
  EXPECT_EQ(solution.summary.coverage.empty_patches, 4 * 3);
  // With a smoothness term they move.
  const LevelSolution smooth = FitLevel(view, std::vector<Term>{PointTerm{}, SmoothnessTerm{}});
  EXPECT_EQ(smooth.summary.free_vertices, static_cast<int>(start.vertices.size()));
  EXPECT_GT((smooth.net.At(10, 3) - start.At(10, 3)).norm(), 1e-3);
}

double SurfaceDistance(const ControlNet& a, const ControlNet& b) {
  double largest = 0;
  for (int j = 0; j <= 100; ++j) {
    for (int i = 0; i <= 100; ++i) {
      const Stencil s = PlainStencil(a.columns - 3, a.rows - 3, Vec2(i, j) / 100);
      largest = std::max(largest, (s.Apply(a) - s.Apply(b)).norm());
    }
  }
  return largest;
}

double ObservationDistance(const LevelView& view, const ControlNet& a, const ControlNet& b) {
  double largest = 0;
  for (const Observation& o : view.observations) {
    const Stencil s = view.grid.StencilAt(o.uv);
    largest = std::max(largest, (s.Apply(a) - s.Apply(b)).norm());
  }
  return largest;
}

// In a disc of 36 mm without data, the exact thin-plate energy keeps the surface bounded for any
// weight. A sampled energy is known to diverge.
TEST(ScheduleStep, AHoleInTheDataStaysBounded) {
  const int m = 16, n = 12;
  const ControlNet rest = Sheet(m, n, 0, 0);
  ControlNet truth = rest;
  for (int j = 0; j < truth.rows; ++j) {
    for (int i = 0; i < truth.columns; ++i) {
      truth.At(i, j) += 8 * Vec3(0, 0, std::cos(0.6 * i) * std::cos(0.45 * j));
    }
  }
  std::vector<Observation> observations;
  for (const Observation& o : Observe(truth, 3000, 11, 0.5)) {
    const Vec3 p = PlainStencil(m, n, o.uv).Apply(rest);
    const bool hole = std::hypot(p.x() - 40, p.y() - 30) < 18;
    if (!hole) {
      observations.push_back(o);
    }
  }
  for (const double weight : {1e-2, 1e-4, 1e-6}) {
    const LevelSolution solution = FitLevel(
        View(rest, observations), std::vector<Term>{PointTerm{}, SmoothnessTerm{.weight = weight}});
    EXPECT_LT(SurfaceDistance(solution.net, truth), 20) << weight;
    EXPECT_GT(solution.summary.uncovered_vertices, 0);
  }
}

// Random data, patches with few points, many copies of one point, and points on one line.
std::vector<LevelView> ViewsOfEveryRank() {
  std::vector<LevelView> views = {NoisyView()};
  views.push_back(View(Sheet(4, 3, 2, 1), Observe(Sheet(4, 3, 3, 2), 20, 3, 1)));
  std::vector<Observation> copies = Observe(Sheet(4, 3, 3, 2), 4, 5, 1), line = copies;
  for (int k = 0; k < 100; ++k) {
    copies.push_back(copies[k % 4]);
    copies.back().position.z() += k % 7;
    line.push_back(line.front());
    line.back().uv.x() = 0.01 * k;
  }
  views.push_back(View(Sheet(4, 3, 2, 1), copies));
  views.push_back(View(Sheet(4, 3, 2, 1), line));
  return views;
}

// The dense rows of all points, without compression.
ControlNet DenseMinimiser(const LevelView& view) {
  DenseSystem dense;
  AddPoints(view, dense);
  Eigen::MatrixXd x0(view.start.vertices.size(), 3);
  for (std::size_t k = 0; k < view.start.vertices.size(); ++k) {
    x0.row(k) = view.start.vertices[k];
  }
  x0 += dense.a.completeOrthogonalDecomposition().solve(dense.b - dense.a * x0);
  ControlNet net = view.start;
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    net.vertices[k] = x0.row(k);
  }
  return net;
}

// Ceres stops when its cost no longer falls, so its tolerance is wider.
TEST(ScheduleStep, ReducedPointsAndTheDirectPathKeepTheMinimiser) {
  const std::vector<Term> points = {PointTerm{}};
  const std::vector<Term> held = {PointTerm{}, SmoothnessTerm{}, MembraneTerm{}, PriorTerm{}};
  for (const LevelView& view : ViewsOfEveryRank()) {
    SCOPED_TRACE(view.observations.size());
    const LevelSolution direct = FitLevel(view, points, Solver::kFastest),
                        ceres = FitLevel(view, points, Solver::kCeres);
    const ControlNet reference = DenseMinimiser(view);
    EXPECT_LT(ObservationDistance(view, direct.net, reference), 1e-9);
    EXPECT_LT(ObservationDistance(view, ceres.net, reference), 1e-7);
    EXPECT_EQ(direct.summary.free_vertices, ceres.summary.free_vertices);
    EXPECT_LT(LargestMove(FitLevel(view, held, Solver::kFastest).net, FitLevel(view, held).net),
              1e-8);
  }
}

// Seeds at the centres of all patches hardly determine the wave from vertex to vertex, and points
// beside them contradict them. Least squares moves vertices without bound to fit both.
TEST(ScheduleStep, PointsAloneDoNotMakeVerticesRunAway) {
  const int side = 24;
  const LevelView seeds = [&] {
    std::vector<Observation> all;
    for (int k = 0; k < side * side; ++k) {
      const Vec2 uv = Vec2(k % side + 0.5, k / side + 0.5) / side;
      all.push_back(
          {.uv = uv, .position = PlainStencil(side, side, uv).Apply(Sheet(side, side, 0, 0))});
    }
    return View(Sheet(side, side, 0, 0), all);
  }();
  LevelView both = seeds;
  const double misfit_mm = 3;
  for (int k = 0; k < 9; ++k) {
    Observation beside = seeds.observations[side * (3 + 2 * (k / 3)) + 4 + 5 * (k % 3)];
    beside.uv.x() += 0.02 / side;
    beside.position.z() += misfit_mm;
    both.observations.push_back(beside);
  }
  for (const Solver solver : {Solver::kCeres, Solver::kFastest}) {
    const LevelSolution solution = FitLevelHeld(both, std::vector<Term>{PointTerm{}}, solver);
    EXPECT_GT(solution.summary.hold, 0);
    EXPECT_LT(solution.summary.max_move_mm, 10 * misfit_mm);
    EXPECT_EQ(solution.summary.terms.size(), 1u);
    EXPECT_LT(solution.summary.rms_after_mm, solution.summary.rms_before_mm);
    EXPECT_EQ(FitLevelHeld(seeds, std::vector<Term>{PointTerm{}}, solver).summary.hold, 0);
  }
}

// The sum of squares changes by a constant, whatever the rank of the rows.
TEST(RowReduction, KeepsTheNormalEquationsInAsFewRows) {
  Random random(5);
  const auto number = [&] { return random.Uniform(-1, 1); };
  for (const int rank : {16, 9, 1}) {
    for (const int count : {10, 17, 128, 1000}) {
      const Eigen::MatrixXd a = Eigen::MatrixXd::NullaryExpr(count, rank, number) *
                                Eigen::MatrixXd::NullaryExpr(rank, 16, number);
      const Rows3 b = 100 * Rows3::NullaryExpr(count, 3, number);
      const LinearRows few = CompressRows(a, b);
      EXPECT_LE(few.a.rows(), count > 16 ? rank : count);
      EXPECT_LT((few.a.transpose() * few.a - a.transpose() * a).norm(), 1e-13 * a.squaredNorm());
      EXPECT_LT((few.a.transpose() * few.b - a.transpose() * b).norm(),
                1e-13 * a.norm() * b.norm());
    }
  }
}

TEST(ScheduleStep, OrderOfPointsChangesNoByte) {
  LevelView view = NoisyView();
  const std::vector<Term> terms = {PointTerm{}, SmoothnessTerm{}};
  const LevelSolution a = FitLevel(view, terms);
  std::reverse(view.observations.begin(), view.observations.end());
  std::swap(view.observations[3], view.observations[77]);
  const LevelSolution b = FitLevel(view, terms);
  EXPECT_TRUE(SameBytes(a.net, b.net));
  EXPECT_EQ(a.summary.rms_after_mm, b.summary.rms_after_mm);
}

TEST(ScheduleStep, TheCostFallsAndNoNeighbourIsBetter) {
  const LevelView view = NoisyView();
  const std::vector<Term> terms = AllTerms();
  const auto cost = [&](const ControlNet& net) {
    double sum = 0;
    for (const Term& term : terms) {
      sum += std::visit([&](const auto& t) { return TermCost(t, view, net); }, term);
    }
    return sum;
  };
  const LevelSolution solution = FitLevel(view, terms);
  double before = 0, after = 0;
  for (const TermCosts& t : solution.summary.terms) {
    before += t.before;
    after += t.after;
  }
  EXPECT_NEAR(before, cost(view.start), 1e-9 * before);
  EXPECT_NEAR(after, cost(solution.net), 1e-9 * after);
  EXPECT_LT(after, before);
  Random random(12);
  for (int trial = 0; trial < 50; ++trial) {
    ControlNet other = solution.net;
    for (Vec3& v : other.vertices) {
      v += random.InBox(-1e-2, 1e-2);
    }
    EXPECT_GT(cost(other), after);
  }
}

TEST(ScheduleStep, RobustLossesResistOutliers) {
  const ControlNet truth = Sheet(4, 3, 3, 2);
  std::vector<Observation> observations = Observe(truth, 300, 3);
  for (int k = 0; k < 15; ++k) {
    observations[20 * k].position += Vec3(0, 0, 40);
  }
  const LevelView view = View(Sheet(4, 3, 0, 0), observations);
  const auto error = [&](RobustLoss loss) {
    return LargestMove(
        FitLevel(view, std::vector<Term>{PointTerm{.loss = loss, .loss_width_mm = 0.5}}).net,
        truth);
  };
  const double plain = error(RobustLoss::kNone);
  EXPECT_LT(error(RobustLoss::kHuber), 0.3 * plain);
  EXPECT_LT(error(RobustLoss::kCauchy), 0.05 * plain);
  // Tukey's loss needs a near start, so it starts from the result of the others.
  LevelView near = view;
  near.start = FitLevel(view, std::vector<Term>{PointTerm{.loss = RobustLoss::kHuber}}).net;
  const PointTerm tukey{.loss = RobustLoss::kTukey, .loss_width_mm = 10};
  EXPECT_LT(LargestMove(FitLevel(near, std::vector<Term>{tukey}).net, truth), 1e-3 * plain);
}

TEST(ScheduleStep, NothingToSolveLeavesTheNet) {
  const LevelView view = View(Sheet(4, 3, 1, 1), {});
  const LevelSolution solution = FitLevel(view, std::vector<Term>{PointTerm{}});
  EXPECT_TRUE(SameBytes(solution.net, view.start));
  EXPECT_EQ(solution.summary.termination, "nothing to solve");
  EXPECT_EQ(solution.summary.free_vertices, 0);
  EXPECT_EQ(solution.summary.rank, 0);
}

TEST(ScheduleStep, WrongInputIsNamed) {
  LevelView view = NoisyView();
  view.lengths_mm.x() = 0;
  const std::vector<Term> smooth = {PointTerm{}, SmoothnessTerm{}}, points = {PointTerm{}};
  const auto message = [](const LevelView& v, const std::vector<Term>& terms) -> std::string {
    try {
      FitLevel(v, terms);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(message(view, smooth), HasSubstr("more than a point or a line"));
  EXPECT_EQ(message(view, points), "no error");
  view.rest.vertices.pop_back();
  EXPECT_THAT(message(view, points), HasSubstr("same shape"));
}

}  // namespace
}  // namespace semblance::fitting
