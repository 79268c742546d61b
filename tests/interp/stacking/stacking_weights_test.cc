// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/stacking/stacking_weights.h"

#include <gtest/gtest.h>

#include <limits>

#include "surfaces/base/random.h"

namespace semblance::interp {
namespace {

Eigen::VectorXd Alike(const Eigen::MatrixXd& errors) {
  return Eigen::VectorXd::Ones(errors.rows());
}

Eigen::VectorXd Weights(const Eigen::MatrixXd& errors, double caution) {
  return StackingWeights(errors, Alike(errors), caution);
}

Eigen::MatrixXd Drawn(int points, int predictors, std::uint64_t random_seed) {
  Random random(random_seed);
  Eigen::MatrixXd errors(points, predictors);
  for (int i = 0; i < points; ++i) {
    const double shared = random.Uniform(-1, 1);
    for (int k = 0; k < predictors; ++k) {
      errors(i, k) = shared + (0.3 + 0.4 * k) * random.Uniform(-1, 1);
    }
  }
  return errors;
}

double Cost(const Eigen::MatrixXd& errors, const Eigen::VectorXd& weights, double caution) {
  const double points = static_cast<double>(errors.rows());
  const double least = errors.colwise().squaredNorm().minCoeff() / points;
  const auto equal = 1 / static_cast<double>(errors.cols());
  return (errors * weights).squaredNorm() / points +
         caution * least * (weights.array() - equal).square().sum();
}

TEST(StackingWeights, AreOfSumOneAndNoneBelowZero) {
  for (int seed = 0; seed < 50; ++seed) {
    const Eigen::VectorXd weights = Weights(Drawn(6 + seed % 20, 2 + seed % 6, seed), 0);
    EXPECT_NEAR(weights.sum(), 1, 1e-12);
    EXPECT_GE(weights.minCoeff(), 0);
  }
}

// Compared with every point of a fine grid on the triangle of weights.
TEST(StackingWeights, AreTheBestOfAllMixtures) {
  constexpr int kGrid = 200;
  for (int seed = 0; seed < 30; ++seed) {
    for (const double caution : {0.0, 0.5}) {
      const Eigen::MatrixXd errors = Drawn(5 + seed, 3, seed);
      double least = std::numeric_limits<double>::infinity();
      for (int a = 0; a <= kGrid; ++a) {
        for (int b = 0; a + b <= kGrid; ++b) {
          const Eigen::Vector3d weights = Eigen::Vector3d(a, b, kGrid - a - b) / kGrid;
          least = std::min(least, Cost(errors, weights, caution));
        }
      }
      const double found = Cost(errors, Weights(errors, caution), caution);
      EXPECT_LE(found, least + 1e-12);
      EXPECT_GE(found, least * 0.98);
    }
  }
}

TEST(StackingWeights, CountAPointOfImportanceTwoAsTwoPoints) {
  const Eigen::MatrixXd errors = Drawn(6, 3, 9);
  Eigen::MatrixXd twice(7, 3);
  twice << errors, errors.row(2);
  Eigen::VectorXd importance = Alike(errors);
  importance[2] = 2;
  EXPECT_LT((StackingWeights(errors, importance, 0.1) - Weights(twice, 0.1)).norm(), 1e-9);
}

TEST(StackingWeights, TakeAPredictorThatIsAlwaysBetterAlone) {
  Eigen::MatrixXd errors(4, 2);
  errors << 1, 2, -1, -2, 2, 4, -0.5, -1;
  EXPECT_EQ(Weights(errors, 0), Eigen::Vector2d(1, 0));
}

TEST(StackingWeights, BecomeEqualWithCaution) {
  const Eigen::VectorXd weights = Weights(Drawn(20, 4, 1), 1e6);
  EXPECT_LT((weights.array() - 0.25).abs().maxCoeff(), 1e-4);
}

TEST(StackingWeights, AreValidForTwinsAndExactPredictors) {
  Eigen::MatrixXd twins = Drawn(10, 3, 2);
  twins.col(1) = twins.col(0);
  const Eigen::VectorXd weights = Weights(twins, 0);
  EXPECT_NEAR(weights.sum(), 1, 1e-12);
  EXPECT_GE(weights.minCoeff(), 0);
  EXPECT_EQ(Weights(Eigen::MatrixXd::Zero(5, 3), 0.1).sum(), 1);
  EXPECT_EQ(Weights(Drawn(7, 1, 1), 0.1), Eigen::VectorXd::Ones(1));
}

TEST(StackedErrors, UseWeightsFromTheOtherPoints) {
  const Eigen::MatrixXd errors = Drawn(8, 3, 4);
  const Eigen::VectorXd stacked = StackedErrors(errors, Alike(errors), 0.1);
  const Eigen::MatrixXd others = errors.bottomRows(7);
  EXPECT_NEAR(stacked[0], errors.row(0).dot(Weights(others, 0.1)), 1e-12);
}

}  // namespace
}  // namespace semblance::interp
