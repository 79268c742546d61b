// SPDX-License-Identifier: GPL-3.0-or-later
// How much to trust each of several predictors, from their errors on what they were not shown
// (stacked regressions: Wolpert 1992, Neural Networks 5; Breiman 1996, Machine Learning 24).
#pragma once

#include <Eigen/Core>

namespace semblance {

// errors: one row per point, one column per predictor, finite, at least one of each; importance: of
// each point, above 0. The weights >= 0 of sum 1 whose mixed predictor has the least mean squared
// error, by importance, plus caution times the least mean squared error of one predictor times the
// squared distance of the weights from equal ones. caution >= 0; large, all count alike.
Eigen::VectorXd StackingWeights(const Eigen::MatrixXd& errors, const Eigen::VectorXd& importance,
                                double caution);

// What the mixture errs at each point if its weights come from the other points alone: row sums of
// errors times weights.
Eigen::VectorXd StackedErrors(const Eigen::MatrixXd& errors, const Eigen::VectorXd& importance,
                              double caution);

}  // namespace semblance
