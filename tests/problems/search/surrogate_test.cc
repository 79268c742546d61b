// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/surrogate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/base/random.h"

namespace semblance {
namespace {

// A wave along the first of two numbers, the same along the second.
KnownCosts Wave(int n) {
  Random random(5);
  KnownCosts known{
      .codes = Eigen::MatrixXd(2, n), .costs = Eigen::VectorXd(n), .axes_of_code = {0, 1}};
  for (int k = 0; k < n; ++k) {
    known.codes(0, k) = random.Uniform();
    known.codes(1, k) = random.Uniform();
    known.costs[k] = std::sin(6 * known.codes(0, k));
  }
  return known;
}

TEST(Surrogate, GoesThroughWhatIsKnownAndFindsTheAxisThatMatters) {
  const KnownCosts known = Wave(25);
  const SurrogateHyper hyper = FitSurrogate(known, {});
  EXPECT_GT(hyper.log_lengths[1], hyper.log_lengths[0] + 1);
  const Surrogate surrogate(known, hyper);
  for (Eigen::Index k = 0; k < known.costs.size(); ++k) {
    EXPECT_NEAR(surrogate.At(known.codes.col(k)).mean, known.costs[k], 0.01);
  }
  Random random(6);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector2d code(random.Uniform(0.1, 0.9), random.Uniform(0.1, 0.9));
    const ExpectedCost cost = surrogate.At(code);
    EXPECT_NEAR(cost.mean, std::sin(6 * code[0]), 0.05);
    EXPECT_LT(cost.sd, 0.1);
  }
}

TEST(Surrogate, ExpectedImprovementIsTheIntegralOfWhatLiesBelow) {
  const ExpectedCost cost{.mean = 0.4, .sd = 0.7};
  for (const double best : {-1.5, 0.0, 0.4, 2.0}) {
    double integral = 0;
    constexpr double kStep = 1e-4;
    for (double y = -8; y < best; y += kStep) {
      const double z = (y + kStep / 2 - cost.mean) / cost.sd;
      integral +=
          kStep * (best - y - kStep / 2) * std::exp(-z * z / 2) / (cost.sd * std::sqrt(2 * M_PI));
    }
    EXPECT_NEAR(ExpectedImprovement(cost, best), integral, 1e-6) << best;
  }
  EXPECT_EQ(ExpectedImprovement({.mean = 1, .sd = 0}, 3), 2);
  EXPECT_EQ(ExpectedImprovement({.mean = 3, .sd = 0}, 1), 0);
}

TEST(Surrogate, WhereAllCostsAreEqualItStillAnswers) {
  KnownCosts known = Wave(6);
  known.costs.setZero();
  const Surrogate surrogate(known, FitSurrogate(known, {}));
  EXPECT_NEAR(surrogate.At(Eigen::Vector2d(0.5, 0.5)).mean, 0, 1e-9);
}

}  // namespace
}  // namespace semblance
