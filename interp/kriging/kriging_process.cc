// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/kriging_process.h"

#include <cmath>
#include <numbers>

namespace semblance {
namespace {

constexpr double kFirstJitter = 1e-10;  // of the variance, on the diagonal

}  // namespace

CorrelationValue CorrelationAt(Covariance covariance, double distance_mm, double length_mm) {
  if (!std::isfinite(distance_mm)) {
    return {0, 0};
  }
  const double r = distance_mm / length_mm;
  switch (covariance) {
    case Covariance::kMatern12:
      return {std::exp(-r), r * std::exp(-r)};
    case Covariance::kMatern32: {
      const double s = std::numbers::sqrt3 * r;
      return {(1 + s) * std::exp(-s), s * s * std::exp(-s)};
    }
    case Covariance::kMatern52: {
      const double s = std::sqrt(5.0) * r;
      return {(1 + s + s * s / 3) * std::exp(-s), s * s * (1 + s) / 3 * std::exp(-s)};
    }
    case Covariance::kSquaredExponential:
      break;
  }
  const double value = std::exp(-r * r / 2);
  return {value, r * r * value};
}

KrigingProcess::KrigingProcess(Covariance covariance, const KrigingData& data,
                               const KrigingHyper& hyper)
    : covariance_(covariance),
      hyper_(hyper),
      variance_mm2_(hyper.signal_mm * hyper.signal_mm),
      nugget_mm2_(data.nugget_mm2) {
  Factor(data);
  const Eigen::Index n = data.depth_mm.size();
  inverse_ones_ = factor_.solve(Eigen::VectorXd::Ones(n));
  ones_ = inverse_ones_.sum();
  mean_mm_ = inverse_ones_.dot(data.depth_mm) / ones_;
  const Eigen::VectorXd residual = data.depth_mm.array() - mean_mm_;
  inverse_residual_ = factor_.solve(residual);
  misfit_ = residual.dot(inverse_residual_);
  FindWeights(data);
}

void KrigingProcess::Factor(const KrigingData& data) {
  const Eigen::Index n = data.depth_mm.size();
  Eigen::MatrixXd matrix(n, n);
  by_log_length_.resize(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index k = 0; k <= j; ++k) {
      const double between_mm = (data.distance_mm(j, k) + data.distance_mm(k, j)) / 2;
      const CorrelationValue c = CorrelationAt(covariance_, between_mm, hyper_.length_mm);
      matrix(j, k) = matrix(k, j) = variance_mm2_ * c.value;
      by_log_length_(j, k) = by_log_length_(k, j) = variance_mm2_ * c.by_log_length;
    }
  }
  matrix.diagonal() += nugget_mm2_;
  for (double jitter = kFirstJitter; jitter < 100; jitter *= 10) {
    factor_.compute(matrix + jitter * variance_mm2_ * Eigen::MatrixXd::Identity(n, n));
    if (factor_.info() == Eigen::Success) {
      return;
    }
  }
}

// With ways that are not quite symmetric, and a diagonal that had to grow, the field misses the
// dowels a little; it is brought nearer to them for as long as that helps. To solve the equations
// of the ways themselves would be exact and wild: they need not be definite.
void KrigingProcess::FindWeights(const KrigingData& data) {
  constexpr int kRounds = 20;
  weights_ = inverse_residual_;
  if (data.distance_mm == data.distance_mm.transpose()) {
    return;
  }
  Eigen::MatrixXd with = CovarianceAt(data.distance_mm);
  with.diagonal() += nugget_mm2_;
  const auto miss = [&](const Eigen::VectorXd& weights) -> Eigen::VectorXd {
    return (data.depth_mm.array() - mean_mm_).matrix() - with * weights;
  };
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::VectorXd off = miss(weights_);
    const Eigen::VectorXd nearer = weights_ + factor_.solve(off);
    if (!(miss(nearer).norm() < off.norm())) {
      return;
    }
    weights_ = nearer;
  }
}

double KrigingProcess::Deviance() const {
  return 2 * factor_.matrixLLT().diagonal().array().log().sum() + std::log(ones_) + misfit_;
}

Vec2 KrigingProcess::DevianceGradient() const {
  const Eigen::Index n = weights_.size();
  const Eigen::MatrixXd inverse = factor_.solve(Eigen::MatrixXd::Identity(n, n));
  const auto along = [&](const Eigen::MatrixXd& change) {  // of V
    return inverse.cwiseProduct(change).sum() - inverse_ones_.dot(change * inverse_ones_) / ones_ -
           inverse_residual_.dot(change * inverse_residual_);
  };
  Eigen::MatrixXd by_log_signal = 2 * factor_.reconstructedMatrix();
  by_log_signal.diagonal() -= 2 * nugget_mm2_;
  return {along(by_log_length_), along(by_log_signal)};
}

void KrigingProcess::PrepareSd() {
  const Eigen::Index n = weights_.size();
  inverse_root_ = factor_.matrixL().solve(Eigen::MatrixXd::Identity(n, n));
}

Eigen::MatrixXd KrigingProcess::CovarianceAt(const Eigen::MatrixXd& distance_mm) const {
  return distance_mm.unaryExpr([&](double mm) {
    return variance_mm2_ * CorrelationAt(covariance_, mm, hyper_.length_mm).value;
  });
}

DepthValue KrigingProcess::ValueAt(const Eigen::Ref<const Eigen::VectorXd>& distance_mm) const {
  const Eigen::VectorXd with = CovarianceAt(distance_mm);
  return {mean_mm_ + with.dot(weights_), inverse_root_.size() > 0 ? Sd(with) : kNaN};
}

DepthPosterior KrigingProcess::Posterior(const Eigen::MatrixXd& to_dowels_mm,
                                         const Eigen::MatrixXd& between_mm) const {
  const Eigen::MatrixXd with = CovarianceAt(to_dowels_mm);
  const Eigen::MatrixXd known = factor_.matrixL().solve(with);
  const Eigen::VectorXd of_mean = 1 - (with.transpose() * inverse_ones_).array();
  return {
      (with.transpose() * weights_).array() + mean_mm_,
      CovarianceAt(between_mm) - known.transpose() * known + of_mean * of_mean.transpose() / ones_};
}

double KrigingProcess::Sd(const Eigen::VectorXd& with) const {
  const double of_mean = 1 - inverse_ones_.dot(with);
  const double variance =
      variance_mm2_ - (inverse_root_ * with).squaredNorm() + of_mean * of_mean / ones_;
  return std::sqrt(std::max(variance, 0.0));
}

}  // namespace semblance
