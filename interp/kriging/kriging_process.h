// SPDX-License-Identifier: GPL-3.0-or-later
// The Gaussian process of kriging: its likelihood, and its values once length and signal are known.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "interp/kriging/bounded_minimum.h"
#include "interp/kriging/gaussian_regression.h"
#include "interp/kriging/kriging.h"
#include "surfaces/base/run_context.h"

namespace semblance::interp {

// The data of a process: n dowels.
struct KrigingData {
  // n x n; row j, column k is the distance from dowel k to the base of dowel j. Geodesic distances
  // are only nearly symmetric and may be infinite.
  Eigen::MatrixXd distance_mm;
  Eigen::VectorXd depth_mm;    // n
  Eigen::VectorXd nugget_mm2;  // n; variance of each depth, 0 if certain
  Eigen::MatrixXd regressors;  // n x q; a column of 1 for a constant mean
};

struct KrigingHyper {
  double length_mm = 1;
  double signal_mm = 1;
  std::vector<std::string> at_end = {};  // DepthProcess::at_end
};

// Correlation at a distance, and its derivative with respect to the logarithm of the length.
struct CorrelationValue {
  double value = kNaN;
  double by_log_length = kNaN;
};
// The correlation is 1 at distance 0 and 0 at an infinite distance. The Matern family is scaled so
// that the length has the same meaning in all members (Rasmussen & Williams 2006, eq. 4.14 to
// 4.18).
CorrelationValue CorrelationAt(Covariance covariance, double distance_mm, double length_mm);

// The process with covariance V = signal^2 K + nugget of the dowels. If V is not positive definite,
// which happens with geodesic distances, its diagonal is increased until it is.
class KrigingProcess {
 public:
  KrigingProcess(Covariance covariance, const KrigingData& data, const KrigingHyper& hyper);

  // The regressors' coefficients by generalised least squares; for a constant mean, that mean in
  // mm.
  const Eigen::VectorXd& coefficients() const { return regression_.coefficients(); }

  double Deviance() const { return regression_.Deviance(); }
  double Misfit() const { return regression_.Misfit(); }
  // The derivatives of the deviance with respect to the logarithms of length and signal.
  Vec2 DevianceGradient() const;

  // Must be called before the first ValueAt with an sd; costs n^3.
  void PrepareSd();
  // The depth and sd at a point. distance_mm: n, from each dowel to the point; regressors: q, at
  // the point. If geodesic distances make the variance negative the sd is NaN, or 0 at an
  // interpolated dowel.
  DepthValue ValueAt(const Eigen::Ref<const Eigen::VectorXd>& distance_mm,
                     const Eigen::VectorXd& regressors) const;
  // The joint distribution at m points. to_dowels_mm: n x m; between_mm: m x m, symmetric;
  // regressors: q x m.
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
  Eigen::MatrixXd by_log_length_, by_log_signal_;  // derivatives of V
  GaussianRegression regression_;
  Eigen::VectorXd weights_;  // factors of a point's covariances with the dowels
  bool with_sd_ = false;
};

// Describes the numbers of a search that ended at a bound, for DepthProcess::at_end. names: one per
// number.
std::vector<std::string> DescribeRangeEnds(std::span<const std::string_view> names,
                                           const SearchRange& bounds, const SmoothCost& cost,
                                           const Eigen::VectorXd& logs);

// Minimises a cost over the logarithms of length, signal (and a nugget). If the signal ends at its
// upper bound, the function widens `bounds` and searches again: a long length needs a signal of
// many times the depths' spread, because only differences between dowels are observed.
// misfit_mm2(length) is r'R^-1 r for the depths' residuals r and their correlations R without
// nugget. It bounds the signal: with n - q eigenvalues the deviance at a length is a sum of
// log(signal^2 + b) + z^2 / (signal^2 + b) with b >= 0, where the z^2 sum to the misfit. Hence the
// best signal^2 is at most the misfit; the range ends at four times the misfit.
Eigen::VectorXd FindLogs(SearchRange& bounds, const SmoothCost& cost,
                         const std::function<double(double)>& misfit_mm2, const RunContext& run);

// Returns true if a process's signal is given or can be estimated. The restricted likelihood has n
// - q degrees of freedom (regressors: n x q), so that as many depths as factors determine only the
// mean. Without a signal there is no sd.
bool KnowsSignal(const std::optional<double>& signal_mm, const Eigen::MatrixXd& regressors);

// The RMS deviation of depths from their mean, mm; at least 1e-3.
double DepthSpread(const Eigen::VectorXd& depth_mm);

// Fits length and signal: minimises Deviance() plus the length's log-normal prior, by FindLogs with
// exact derivatives. The length stays within a factor of 20 (e^3) of the prior's median, and the
// signal within 1/30 to 10 times the depths' spread (or more, see FindLogs). Values that the
// options fix are kept. Throws Cancelled if stopped.
KrigingHyper FitHyper(const Kriging& options, const KrigingData& data, const RunContext& run);

}  // namespace semblance::interp
