// SPDX-License-Identifier: GPL-3.0-or-later
// Values with a known covariance and a mean that is linear in known regressors: universal kriging.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace semblance {

// y ~ N(F b, V) with unknown b: n values, n x q regressors F of full rank, q <= n.
class GaussianRegression {
 public:
  // Where V is singular by rounding, or not positive definite, its diagonal grows by parts of
  // `variance` until it is.
  GaussianRegression(const Eigen::MatrixXd& covariance, double variance, Eigen::VectorXd values,
                     Eigen::MatrixXd regressors);

  // b, by generalised least squares.
  const Eigen::VectorXd& coefficients() const { return coefficients_; }
  // V^-1 (y - F b): what a covariance with the values is multiplied by.
  const Eigen::VectorXd& weights() const { return weights_; }
  // What V's diagonal grew by.
  double added() const { return added_; }
  Eigen::VectorXd Solve(const Eigen::VectorXd& right) const { return factor_.solve(right); }

  // r'V^-1 r, r = y - F b.
  double Misfit() const { return misfit_; }
  // log |V| + log |F'V^-1 F| + r'V^-1 r, r = y - F b: minus twice the restricted log likelihood,
  // but for a constant (Harville 1974).
  double Deviance() const;
  // Its derivative along a change of V, n x n and symmetric.
  double DevianceAlong(const Eigen::MatrixXd& change) const;

  // Before Variance; costs the cube of n.
  void PrepareVariance();
  // Of the value at a point, given y: `with` are its covariances with the values, `regressors` its
  // own (q), `own` its variance.
  double Variance(const Eigen::VectorXd& with, const Eigen::VectorXd& regressors, double own) const;
  // The same of m points together: with n x m, regressors q x m, own m x m.
  Eigen::MatrixXd Covariance(const Eigen::MatrixXd& with, const Eigen::MatrixXd& regressors,
                             const Eigen::MatrixXd& own) const;

 private:
  Eigen::MatrixXd regressors_, inverse_regressors_;   // F, V^-1 F
  Eigen::LLT<Eigen::MatrixXd> factor_, information_;  // of V and of F'V^-1 F
  Eigen::VectorXd coefficients_, weights_;
  double misfit_ = 0, added_ = 0;
  Eigen::MatrixXd inverse_root_;  // empty without PrepareVariance
};

}  // namespace semblance
