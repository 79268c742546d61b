// SPDX-License-Identifier: GPL-3.0-or-later
// Stacked regression: weights of several predictors from their errors on left-out data (Wolpert
// 1992, Neural Networks 5; Breiman 1996, Machine Learning 24).
#pragma once

#include <Eigen/Core>

namespace semblance::interp {

// Computes the weights (>= 0, sum 1) that minimise the mixture's mean squared error, weighted by
// importance, plus caution * (smallest mean squared error of a single predictor) * (squared
// distance of the weights from equal weights). errors: one row per point and one column per
// predictor, finite, at least one of each. importance: one per point, > 0. caution >= 0; a large
// value gives equal weights.
Eigen::VectorXd StackingWeights(const Eigen::MatrixXd& errors, const Eigen::VectorXd& importance,
                                double caution);

// The mixture's error at each point with weights from all other points.
Eigen::VectorXd StackedErrors(const Eigen::MatrixXd& errors, const Eigen::VectorXd& importance,
                              double caution);

}  // namespace semblance::interp
