// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/stacking/stacking_weights.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <vector>

namespace semblance::interp {
namespace {

// Minimises w' Q w - 2 b' w over the free predictors with weights of sum 1, which may be negative;
// the other weights are 0.
Eigen::VectorXd MinimumOver(const std::vector<Eigen::Index>& free, const Eigen::MatrixXd& q,
                            const Eigen::VectorXd& b) {
  const Eigen::Index n = std::ssize(free);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + 1, n + 1);
  Eigen::VectorXd right = Eigen::VectorXd::Ones(n + 1);
  const double scale = q.trace() / static_cast<double>(q.rows());
  matrix.topLeftCorner(n, n) = q(free, free);
  matrix.row(n).head(n).setConstant(scale);
  matrix.col(n).head(n).setConstant(scale);
  right.head(n) = b(free);
  right[n] = scale;
  const Eigen::VectorXd solution = Eigen::FullPivLU<Eigen::MatrixXd>(matrix).solve(right);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(q.rows());
  weights(free) = solution.head(n);
  return weights;
}

// The predictor without weight whose increase reduces the cost fastest; -1 if none does.
Eigen::Index FindPredictorToFree(const Eigen::VectorXd& weights, const Eigen::MatrixXd& q,
                                 const Eigen::VectorXd& b) {
  const Eigen::VectorXd slope = q * weights - b;
  const double level = slope.dot(weights);  // equal for all predictors with a weight
  const double least_gain = 1e-10 * q.diagonal().maxCoeff();
  Eigen::Index best = -1;
  for (Eigen::Index k = 0; k < slope.size(); ++k) {
    if (weights[k] == 0 && slope[k] < level - least_gain && (best < 0 || slope[k] < slope[best])) {
      best = k;
    }
  }
  return best;
}

// Moves `weights` to the minimum over `free` and repeats until no weight would become negative; a
// weight that reaches 0 is removed from `free`.
void MoveToMinimum(std::vector<Eigen::Index>& free, const Eigen::MatrixXd& q,
                   const Eigen::VectorXd& b, Eigen::VectorXd& weights) {
  while (true) {
    const Eigen::VectorXd aim = MinimumOver(free, q, b);
    double share = 1;
    Eigen::Index stops = -1;
    for (const Eigen::Index k : free) {
      if (aim[k] < 0 && weights[k] / (weights[k] - aim[k]) < share) {
        share = weights[k] / (weights[k] - aim[k]);
        stops = k;
      }
    }
    weights += share * (aim - weights);
    if (stops < 0) {
      return;
    }
    weights[stops] = 0;
    std::erase(free, stops);
  }
}

}  // namespace

// An active set method: starts with the best single predictor and frees one more as long as this
// reduces the cost.
Eigen::VectorXd StackingWeights(const Eigen::MatrixXd& errors, const Eigen::VectorXd& importance,
                                double caution) {
  const Eigen::Index n = errors.cols();
  Eigen::MatrixXd q = errors.transpose() * importance.asDiagonal() * errors / importance.sum();
  Eigen::Index best = 0;
  const double ridge = caution * q.diagonal().minCoeff(&best);
  Eigen::VectorXd weights = Eigen::VectorXd::Unit(n, best);
  if (!(q.diagonal().maxCoeff() > 0)) {
    return weights;  // all predictors are exact
  }
  q.diagonal().array() += ridge;
  const Eigen::VectorXd b = Eigen::VectorXd::Constant(n, ridge / static_cast<double>(n));
  std::vector<Eigen::Index> free = {best};
  for (Eigen::Index round = 0; round < 3 * n; ++round) {
    const Eigen::Index next = FindPredictorToFree(weights, q, b);
    if (next < 0) {
      break;
    }
    free.push_back(next);
    MoveToMinimum(free, q, b, weights);
  }
  weights = weights.cwiseMax(0);
  return weights / weights.sum();
}

Eigen::VectorXd StackedErrors(const Eigen::MatrixXd& errors, const Eigen::VectorXd& importance,
                              double caution) {
  Eigen::VectorXd stacked(errors.rows());
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < errors.rows(); ++i) {
    others.clear();
    for (Eigen::Index k = 0; k < errors.rows(); ++k) {
      if (k != i || errors.rows() == 1) {
        others.push_back(k);
      }
    }
    stacked[i] =
        errors.row(i).dot(StackingWeights(errors(others, Eigen::all), importance(others), caution));
  }
  return stacked;
}

}  // namespace semblance::interp
