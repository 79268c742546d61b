// SPDX-License-Identifier: GPL-3.0-or-later
// Universal kriging: Gaussian values with a known covariance and a mean that is linear in known
// regressors.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace semblance::interp {

// The model y ~ N(F b, V) with n values y, n x q regressors F of full rank (q <= n), and unknown b.
class GaussianRegression {
 public:
  // If V is not positive definite, its diagonal is increased by ever larger fractions of `variance`
  // until it is.
  GaussianRegression(const Eigen::MatrixXd& covariance, double variance, Eigen::VectorXd values,
                     Eigen::MatrixXd regressors);

  // b by generalised least squares.
  const Eigen::VectorXd& coefficients() const { return coefficients_; }
  // V^-1 (y - F b). The product with a point's covariances predicts the point's residual.
  const Eigen::VectorXd& weights() const { return weights_; }
  // The increase of V's diagonal.
  double added() const { return added_; }
  Eigen::VectorXd Solve(const Eigen::VectorXd& right) const { return factor_.solve(right); }

  // r'V^-1 r with r = y - F b.
  double Misfit() const { return misfit_; }
  // log |V| + log |F'V^-1 F| + r'V^-1 r with r = y - F b. This is minus twice the restricted log
  // likelihood, up to a constant (Harville 1974).
  double Deviance() const;
  // The derivative of the deviance along a symmetric change of V (n x n).
  double DevianceAlong(const Eigen::MatrixXd& change) const;

  // Must be called before Variance; costs n^3.
  void PrepareVariance();
  // The variance of the value at a point, given y. with: the point's covariances with the values;
  // regressors: the point's regressors (q); own: the point's prior variance.
  double Variance(const Eigen::VectorXd& with, const Eigen::VectorXd& regressors, double own) const;
  // The covariance of m points, given y. with: n x m; regressors: q x m; own: m x m.
  Eigen::MatrixXd Covariance(const Eigen::MatrixXd& with, const Eigen::MatrixXd& regressors,
                             const Eigen::MatrixXd& own) const;

 private:
  Eigen::MatrixXd regressors_, inverse_regressors_;   // F, V^-1 F
  Eigen::LLT<Eigen::MatrixXd> factor_, information_;  // of V and of F'V^-1 F
  Eigen::VectorXd coefficients_, weights_;
  double misfit_ = 0, added_ = 0;
  Eigen::MatrixXd inverse_root_;  // empty without PrepareVariance
};

}  // namespace semblance::interp
