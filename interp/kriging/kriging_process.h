// SPDX-License-Identifier: GPL-3.0-or-later
// The Gaussian process behind kriging, once its length and signal are known.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "interp/kriging/gaussian_regression.h"
#include "interp/kriging/kriging.h"

namespace semblance {

// What a process is conditioned on: n dowels.
struct KrigingData {
  // n x n: row j, column k is the distance from dowel k to the base of dowel j. Along a surface it
  // is only about symmetric, and may be infinite.
  Eigen::MatrixXd distance_mm;
  Eigen::VectorXd depth_mm;    // n
  Eigen::VectorXd nugget_mm2;  // n: variance of each depth; 0: certain
  Eigen::MatrixXd regressors;  // n x q: what the mean is linear in; a column of 1 for a constant
};

struct KrigingHyper {
  double length_mm = 1;
  double signal_mm = 1;
  std::vector<std::string> at_end = {};  // DepthProcess::at_end
};

// Correlation at a distance, and its derivative by the logarithm of the length.
struct CorrelationValue {
  double value = kNaN;
  double by_log_length = kNaN;
};
// 1 at distance 0, 0 at an infinite one. As usual, the Matern family is scaled so that the length
// means alike in all (Rasmussen & Williams 2006, eq. 4.14 to 4.18).
CorrelationValue CorrelationAt(Covariance covariance, double distance_mm, double length_mm);

// The dowels' covariance V = signal^2 K + nugget, factored, and the mean that belongs to it. Where
// K is not positive definite (of distances along a surface), the diagonal grows until it is.
class KrigingProcess {
 public:
  KrigingProcess(Covariance covariance, const KrigingData& data, const KrigingHyper& hyper);

  // Of the regressors, by generalised least squares; of a constant mean that mean, mm.
  const Eigen::VectorXd& coefficients() const { return regression_.coefficients(); }

  double Deviance() const { return regression_.Deviance(); }
  double Misfit() const { return regression_.Misfit(); }
  // Its derivatives by the logarithms of the length and of the signal.
  Vec2 DevianceGradient() const;

  // Before the first ValueAt with an sd; costs the cube of n.
  void PrepareSd();
  // distance_mm: n, from each dowel to the point; regressors: q, at the point. The sd is NaN where
  // distances along a surface make the variance negative; at a dowel that the field goes through it
  // is then 0.
  DepthValue ValueAt(const Eigen::Ref<const Eigen::VectorXd>& distance_mm,
                     const Eigen::VectorXd& regressors) const;
  // Of m points together. to_dowels_mm: n x m; between_mm: m x m, symmetric; regressors: q x m.
  DepthPosterior Posterior(const Eigen::MatrixXd& to_dowels_mm, const Eigen::MatrixXd& between_mm,
                           const Eigen::MatrixXd& regressors) const;

 private:
  GaussianRegression Regression(const KrigingData& data);
  void FindWeights(const KrigingData& data);
  bool IsThroughDowel(const Eigen::Ref<const Eigen::VectorXd>& distance_mm, double depth_mm) const;
  Eigen::MatrixXd CovarianceAt(const Eigen::MatrixXd& distance_mm) const;

  Covariance covariance_;
  KrigingHyper hyper_;
  double variance_mm2_;
  Eigen::VectorXd dowel_depth_mm_;
  Eigen::MatrixXd by_log_length_, by_log_signal_;  // of V
  GaussianRegression regression_;
  Eigen::VectorXd weights_;  // of the dowels' covariances with a point
  bool with_sd_ = false;
};

}  // namespace semblance
