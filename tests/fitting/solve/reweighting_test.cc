// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/space_solve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fitting/terms/term_cost.h"
#include "tests/testing/level_views.h"

namespace semblance {
namespace {

using testing::Observe;
using testing::Sheet;
using testing::View;

// 400 points on 12 patches, one in twenty of them 4 mm off, one in fifty a landmark.
LevelView ViewWithOutliers() {
  std::vector<Observation> observations = Observe(Sheet(4, 3, 1, 2), 400, 3, 0.3);
  for (std::size_t k = 0; k < observations.size(); k += 20) {
    observations[k].position += Vec3(0, 0, 4);
  }
  for (std::size_t k = 7; k < observations.size(); k += 50) {
    observations[k].landmark = true;
  }
  return View(Sheet(4, 3, 1, 1), std::move(observations));
}

std::vector<Term> RobustTerms(RobustLoss loss, double width_mm) {
  return {PointTerm{.weight = 2, .loss = loss, .loss_width_mm = width_mm},
          LandmarkTerm{.weight = 0.5}, MembraneTerm{.weight = 0.02}, PriorTerm{.weight = 1e-4}};
}

double CostOf(const LevelView& view, const std::vector<Term>& terms, const ControlNet& net) {
  double sum = 0;
  for (const Term& term : terms) {
    sum += std::visit([&](const auto& t) { return TermCost(t, view, net); }, term);
  }
  return sum;
}

double LargestMove(const ControlNet& a, const ControlNet& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.vertices.size(); ++k) {
    largest = std::max(largest, (a.vertices[k] - b.vertices[k]).norm());
  }
  return largest;
}

class EachLoss : public ::testing::TestWithParam<std::pair<RobustLoss, double>> {};

// Points reduced patch by patch, step after step, give the surface of the plain form, which looks
// at each point by itself.
TEST_P(EachLoss, ReducedIsThePlainForm) {
  const LevelView view = ViewWithOutliers();
  const auto [loss, width_mm] = GetParam();
  const std::vector<Term> terms = RobustTerms(loss, width_mm);
  ControlNet plain = view.start;
  ASSERT_TRUE(SolveByCeres(view, terms, plain).usable);
  for (const Solver solver : {Solver::kCeres, Solver::kFastest}) {
    const LevelSolution reduced = FitLevel(view, terms, solver);
    EXPECT_TRUE(reduced.summary.usable);
    EXPECT_EQ(reduced.summary.termination, "convergence");
    EXPECT_LT(LargestMove(reduced.net, plain), 1e-5);
    EXPECT_NEAR(CostOf(view, terms, reduced.net), CostOf(view, terms, plain),
                1e-9 * CostOf(view, terms, plain));
  }
}

// One step at the weights of the surface as it stands, again and again.
TEST_P(EachLoss, TheCostFallsWithEveryStep) {
  LevelView view = ViewWithOutliers();
  const auto [loss, width_mm] = GetParam();
  std::vector<Term> terms = RobustTerms(loss, width_mm);
  std::get<PriorTerm>(terms.back()).towards = PriorTowards::kTemplate;
  double cost = CostOf(view, terms, view.start);
  for (int k = 0; k < 10; ++k) {
    const NormalSystem system = SpaceSolve(view, terms, Solver::kFastest).System(terms);
    const Eigen::MatrixXd step = SparseFactor(system.lower, 0).Solve(system.right);
    for (std::size_t v = 0; v < view.start.vertices.size(); ++v) {
      view.start.vertices[v] += step.row(static_cast<Eigen::Index>(v)).transpose();
    }
    const double next = CostOf(view, terms, view.start);
    EXPECT_LE(next, cost * (1 + 1e-12)) << k;
    cost = next;
  }
}

INSTANTIATE_TEST_SUITE_P(Losses, EachLoss,
                         ::testing::Values(std::pair(RobustLoss::kHuber, 0.5),
                                           std::pair(RobustLoss::kCauchy, 1.0),
                                           std::pair(RobustLoss::kTukey, 12.0)));

TEST(Reweighting, PointsWithoutAnyPullLeaveTheSurfaceToTheOtherTerms) {
  LevelView view = ViewWithOutliers();
  for (Observation& o : view.observations) {
    o.position += Vec3(0, 0, 500);  // beyond Tukey's width
  }
  const std::vector<Term> terms = {PointTerm{.loss = RobustLoss::kTukey, .loss_width_mm = 1},
                                   PriorTerm{.weight = 1, .towards = PriorTowards::kTemplate}};
  const LevelSolution solution = FitLevel(view, terms, Solver::kFastest);
  EXPECT_TRUE(solution.summary.usable);
  EXPECT_LT(LargestMove(solution.net, view.rest), 1e-6);
}

}  // namespace
}  // namespace semblance
