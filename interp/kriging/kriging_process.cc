// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/kriging_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace semblance::interp {
namespace {

constexpr double kRounding = 1e-6;    // of the variance; round-off in a variance of 0
constexpr double kMaxMiss_mm = 1e-2;  // a field that misses a dowel by more does not interpolate it

constexpr double kFlatDepths_mm = 1e-3;  // lower bound of the depths' spread

// The ranges of the two logarithms.
SearchRange SearchBounds(const Kriging& options, const KrigingData& data) {
  const double prior = std::log(options.length_prior_mm);
  const double spread = DepthSpread(data.depth_mm);
  SearchRange bounds{Vec2(prior - 3, std::log(spread / 30)),
                     Vec2(prior + 3, std::log(spread * 10))};
  if (options.length_mm) {
    bounds.low[0] = bounds.high[0] = std::log(*options.length_mm);
  }
  if (options.signal_mm) {
    bounds.low[1] = bounds.high[1] = std::log(*options.signal_mm);
  }
  return bounds;
}

KrigingHyper MakeHyper(const Eigen::VectorXd& logs) {
  return {std::exp(logs[0]), std::exp(logs[1])};
}

// The misfit for correlations without nuggets.
double MisfitAt(const Kriging& options, KrigingData data, double length_mm) {
  data.nugget_mm2.setZero();
  return KrigingProcess(options.covariance, data, {length_mm, 1}).Misfit();
}

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
      dowel_depth_mm_(data.depth_mm),
      regression_(Regression(data)) {
  by_log_signal_.diagonal().array() += 2 * regression_.added();
  FindWeights(data);
}

GaussianRegression KrigingProcess::Regression(const KrigingData& data) {
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
  by_log_signal_ = 2 * matrix;
  matrix.diagonal() += data.nugget_mm2;
  return {matrix, variance_mm2_, data.depth_mm, data.regressors};
}

// With slightly asymmetric distances and an increased diagonal the field misses the dowels a
// little. Iterative refinement moves it closer, as long as this helps. Solving the asymmetric
// equations directly would be exact but unstable, because they need not be definite.
void KrigingProcess::FindWeights(const KrigingData& data) {
  constexpr int kRounds = 20;
  weights_ = regression_.weights();
  if (data.distance_mm == data.distance_mm.transpose()) {
    return;
  }
  Eigen::MatrixXd with = CovarianceAt(data.distance_mm);
  with.diagonal() += data.nugget_mm2;
  const Eigen::VectorXd residual = data.depth_mm - data.regressors * coefficients();
  const auto miss = [&](const Eigen::VectorXd& weights) -> Eigen::VectorXd {
    return residual - with * weights;
  };
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::VectorXd off = miss(weights_);
    const Eigen::VectorXd nearer = weights_ + regression_.Solve(off);
    if (!(miss(nearer).norm() < off.norm())) {
      return;
    }
    weights_ = nearer;
  }
}

Vec2 KrigingProcess::DevianceGradient() const {
  return {regression_.DevianceAlong(by_log_length_), regression_.DevianceAlong(by_log_signal_)};
}

void KrigingProcess::PrepareSd() {
  regression_.PrepareVariance();
  with_sd_ = true;
}

Eigen::MatrixXd KrigingProcess::CovarianceAt(const Eigen::MatrixXd& distance_mm) const {
  return distance_mm.unaryExpr([&](double mm) {
    return variance_mm2_ * CorrelationAt(covariance_, mm, hyper_.length_mm).value;
  });
}

bool KrigingProcess::IsThroughDowel(const Eigen::Ref<const Eigen::VectorXd>& distance_mm,
                                    double depth_mm) const {
  Eigen::Index nearest = 0;
  return distance_mm.minCoeff(&nearest) == 0 &&
         std::abs(depth_mm - dowel_depth_mm_[nearest]) < kMaxMiss_mm;
}

DepthValue KrigingProcess::ValueAt(const Eigen::Ref<const Eigen::VectorXd>& distance_mm,
                                   const Eigen::VectorXd& regressors) const {
  const Eigen::VectorXd with = CovarianceAt(distance_mm);
  const double depth_mm = regressors.dot(coefficients()) + with.dot(weights_);
  if (!with_sd_) {
    return {depth_mm, kNaN};
  }
  const double variance = regression_.Variance(with, regressors, variance_mm2_);
  const bool is_known =
      variance > -kRounding * variance_mm2_ || IsThroughDowel(distance_mm, depth_mm);
  return {depth_mm, is_known ? std::sqrt(std::max(variance, 0.0)) : kNaN};
}

DepthPosterior KrigingProcess::Posterior(const Eigen::MatrixXd& to_dowels_mm,
                                         const Eigen::MatrixXd& between_mm,
                                         const Eigen::MatrixXd& regressors) const {
  const Eigen::MatrixXd with = CovarianceAt(to_dowels_mm);
  return {regressors.transpose() * coefficients() + with.transpose() * weights_,
          regression_.Covariance(with, regressors, CovarianceAt(between_mm))};
}

std::vector<std::string> DescribeRangeEnds(std::span<const std::string_view> names,
                                           const SearchRange& bounds, const SmoothCost& cost,
                                           const Eigen::VectorXd& logs) {
  std::vector<std::string> words;
  for (Eigen::Index k = 0; k < std::ssize(names); ++k) {
    const RangeEnd end = EndOfRange(bounds, cost, logs, k);
    if (end != RangeEnd::kNone) {
      words.push_back(fmt::format("the {}, {:.3g} mm, is the {} that is searched", names[k],
                                  std::exp(logs[k]), end == RangeEnd::kLow ? "least" : "greatest"));
    }
  }
  return words;
}

Eigen::VectorXd FindLogs(SearchRange& bounds, const SmoothCost& cost,
                         const std::function<double(double)>& misfit_mm2, const RunContext& run) {
  constexpr Eigen::Index kSignal = 1;
  const Eigen::VectorXd logs = FindMinimum(bounds, cost, run);
  if (EndOfRange(bounds, cost, logs, kSignal) != RangeEnd::kHigh) {
    return logs;
  }
  const double most = misfit_mm2(std::exp(bounds.high[0]));
  bounds.high[kSignal] = std::max(bounds.high[kSignal], std::log(4 * most) / 2);
  const Eigen::VectorXd wider = FindMinimum(bounds, cost, run);
  return cost(wider, nullptr) < cost(logs, nullptr) ? wider : logs;
}

bool KnowsSignal(const std::optional<double>& signal_mm, const Eigen::MatrixXd& regressors) {
  return signal_mm.has_value() || regressors.rows() > regressors.cols();
}

double DepthSpread(const Eigen::VectorXd& depth_mm) {
  const double mean = depth_mm.mean();
  return std::max(std::sqrt((depth_mm.array() - mean).square().mean()), kFlatDepths_mm);
}

KrigingHyper FitHyper(const Kriging& options, const KrigingData& data, const RunContext& run) {
  constexpr std::array<std::string_view, 2> kNames = {"length", "signal"};
  if (options.length_mm && options.signal_mm) {
    return {*options.length_mm, *options.signal_mm};
  }
  const auto cost = [&](const Eigen::VectorXd& logs, Eigen::VectorXd* gradient) {
    const KrigingProcess process(options.covariance, data, MakeHyper(logs));
    const double away = (logs[0] - std::log(options.length_prior_mm)) / options.length_prior_spread;
    if (gradient != nullptr) {
      *gradient = process.DevianceGradient();
      (*gradient)[0] += 2 * away / options.length_prior_spread;
    }
    return process.Deviance() + away * away;
  };
  SearchRange bounds = SearchBounds(options, data);
  const Eigen::VectorXd logs = FindLogs(
      bounds, cost, [&](double length_mm) { return MisfitAt(options, data, length_mm); }, run);
  KrigingHyper hyper = MakeHyper(logs);
  hyper.at_end = DescribeRangeEnds(kNames, bounds, cost, logs);
  return hyper;
}

}  // namespace semblance::interp
