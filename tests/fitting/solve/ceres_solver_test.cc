// SPDX-License-Identifier: GPL-3.0-or-later
// The solvers of a level agree.
#include <gtest/gtest.h>

#include "fitting/solve/ceres_solver.h"
#include "fitting/solve/space_solve.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/random.h"
#include "tests/testing/level_views.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using testing::AllTerms;
using testing::LargestMove;
using testing::NoisyView;
using testing::SmoothSurface;

double CostOf(const std::vector<Term>& terms, const LevelView& view, const ControlNet& net) {
  double cost = 0;
  for (const Term& term : terms) {
    cost += std::visit([&](const auto& t) { return TermCost(t, view, net); }, term);
  }
  return cost;
}

// Without a loss.
bool TreatsAxesAlike(const Term& term) {
  const auto* const points = std::get_if<PointTerm>(&term);
  return SeparableButForLoss(std::span(&term, 1)) &&
         (points == nullptr || points->loss == RobustLoss::kNone);
}

void ExpectAllAgree(const LevelView& view, const std::vector<Term>& terms, double tolerance_mm) {
  ControlNet tiles = view.start, vertices = view.start;
  const SolverOutcome a = SolveBlocked(view, terms, tiles);
  const SolverOutcome b = SolveByCeres(view, terms, vertices);
  const LevelSolution direct = FitLevel(view, terms, Solver::kFastest);
  EXPECT_TRUE(a.usable && b.usable && direct.summary.usable);
  EXPECT_EQ(a.free_vertices, b.free_vertices);
  EXPECT_EQ(a.termination, "convergence");
  EXPECT_LT(LargestMove(tiles, vertices), tolerance_mm);
  const double cost = CostOf(terms, view, direct.net);  // depends little on weakly held vertices
  EXPECT_NEAR(CostOf(terms, view, tiles), cost, 1e-9 * cost + 1e-15);
}

TEST(TileSolver, FindsWhatSingleVerticesFind) {
  std::vector<Term> separable;
  for (const Term& term : AllTerms()) {
    if (TreatsAxesAlike(term)) {
      separable.push_back(term);
    }
  }
  ASSERT_GE(separable.size(), 4u);
  ExpectAllAgree(NoisyView(), separable, 1e-9);
  for (const Term& term : separable) {
    if (!std::holds_alternative<PointTerm>(term)) {
      // Points hold the vertices at the border weakly, and landmarks do not hold them at all.
      const bool more_points = std::holds_alternative<LandmarkTerm>(term);
      ExpectAllAgree(NoisyView(), {PointTerm{}, term}, more_points ? 1e-4 : 1e-6);
    }
  }
}

// Nets whose sides are not multiples of three, open and closed, with vertices that no term affects.
TEST(TileSolver, TilesCoverNetsOfAnySize) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    for (const int patches : {4, 5, 6}) {
      const HSplineShape shape{
          .patches_u = patches, .patches_v = 3, .max_level = 0, .closure = closure};
      const HSplineSurface start = SmoothSurface(shape, 1), truth = SmoothSurface(shape, 2);
      LevelView view{.grid = PatchGrid::Of(shape, 0),
                     .start = start.Net(0),
                     .rest = start.Net(0),
                     .lengths_mm = Vec2(130, 80),
                     .observations = {}};
      Random random(4);
      for (int k = 0; k < 400; ++k) {
        const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 0.6));
        view.observations.push_back({.uv = uv, .position = truth.Point(uv)});
      }
      SortObservations(PointCloud(view.grid.Shape(), view.observations), view.observations);
      ExpectAllAgree(view, {PointTerm{}}, 1e-5);
      ControlNet net = view.start;
      EXPECT_LT(SolveBlocked(view, std::vector<Term>{PointTerm{}}, net).free_vertices,
                static_cast<int>(net.vertices.size()));
      EXPECT_EQ(net.vertices.back(), view.start.vertices.back());  // to the bit
    }
  }
}

// Terms that couple x, y and z, each with all separable terms; the rest is left to Ceres.
TEST(CoupledSolver, FindsWhatCeresFinds) {
  int coupled = 0;
  for (const Term& term : AllTerms()) {
    const std::vector<Term> terms = {PointTerm{.weight = 0.1}, SmoothnessTerm{.weight = 0.1}, term};
    if (!AllLinear(terms) || TreatsAxesAlike(term)) {
      continue;
    }
    ++coupled;
    const LevelView view = NoisyView();
    ControlNet at_once = view.start, by_steps = view.start;
    const SolverOutcome outcome = SolveCoupled(view, terms, at_once);
    const SolverOutcome ceres = SolveByCeres(view, terms, by_steps);
    EXPECT_EQ(outcome.termination, "convergence") << TermName(term);
    EXPECT_EQ(outcome.free_vertices, ceres.free_vertices);
    EXPECT_LT(LargestMove(at_once, by_steps), 1e-5) << TermName(term);
    EXPECT_LE(CostOf(terms, view, at_once), CostOf(terms, view, by_steps) * (1 + 1e-12));
    EXPECT_GT(LargestMove(at_once, view.start), 1e-3);
    EXPECT_EQ(FitLevel(view, terms, Solver::kFastest).summary.solver, "direct");
    EXPECT_EQ(FitLevel(view, terms, Solver::kCeres).summary.solver, "ceres");
  }
  EXPECT_GE(coupled, 2);  // tangent points and symmetry
  for (const Term& term : {Term(SpringTerm{}), Term(DistortionTerm{}), Term(NonPenetrationTerm{}),
                           Term(PointTerm{.loss = RobustLoss::kHuber})}) {
    EXPECT_FALSE(AllLinear(std::span(&term, 1))) << TermName(term);
  }
}

}  // namespace
}  // namespace semblance::fitting
