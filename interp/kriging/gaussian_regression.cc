// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/gaussian_regression.h"

#include <cmath>
#include <utility>

namespace semblance::interp {
namespace {

constexpr double kFirstJitter = 1e-10;  // of the variance, on the diagonal; round-off

double LogDeterminant(const Eigen::LLT<Eigen::MatrixXd>& factor) {
  return 2 * factor.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

GaussianRegression::GaussianRegression(const Eigen::MatrixXd& covariance, double variance,
                                       Eigen::VectorXd values, Eigen::MatrixXd regressors)
    : regressors_(std::move(regressors)) {
  const Eigen::Index n = values.size();
  for (double jitter = kFirstJitter; jitter < 100; jitter *= 10) {
    added_ = jitter * variance;
    factor_.compute(covariance + added_ * Eigen::MatrixXd::Identity(n, n));
    if (factor_.info() == Eigen::Success) {
      break;
    }
  }
  inverse_regressors_ = factor_.solve(regressors_);
  information_.compute(regressors_.transpose() * inverse_regressors_);
  coefficients_ = information_.solve(inverse_regressors_.transpose() * values);
  const Eigen::VectorXd residual = values - regressors_ * coefficients_;
  weights_ = factor_.solve(residual);
  misfit_ = residual.dot(weights_);
}

double GaussianRegression::Deviance() const {
  return LogDeterminant(factor_) + LogDeterminant(information_) + misfit_;
}

double GaussianRegression::DevianceAlong(const Eigen::MatrixXd& change) const {
  const Eigen::Index n = weights_.size();
  const Eigen::MatrixXd of_values = factor_.solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::MatrixXd of_regressors =
      inverse_regressors_.transpose() * change * inverse_regressors_;
  return of_values.cwiseProduct(change).sum() - information_.solve(of_regressors).trace() -
         weights_.dot(change * weights_);
}

void GaussianRegression::PrepareVariance() {
  const Eigen::Index n = weights_.size();
  inverse_root_ = factor_.matrixL().solve(Eigen::MatrixXd::Identity(n, n));
}

double GaussianRegression::Variance(const Eigen::VectorXd& with, const Eigen::VectorXd& regressors,
                                    double own) const {
  const Eigen::VectorXd of_mean = regressors - inverse_regressors_.transpose() * with;
  return own - (inverse_root_ * with).squaredNorm() + of_mean.dot(information_.solve(of_mean));
}

Eigen::MatrixXd GaussianRegression::Covariance(const Eigen::MatrixXd& with,
                                               const Eigen::MatrixXd& regressors,
                                               const Eigen::MatrixXd& own) const {
  const Eigen::MatrixXd known = factor_.matrixL().solve(with);
  const Eigen::MatrixXd of_mean = regressors - inverse_regressors_.transpose() * with;
  return own - known.transpose() * known + of_mean.transpose() * information_.solve(of_mean);
}

}  // namespace semblance::interp
