// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/kriging_likelihood.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace semblance {
namespace {

constexpr double kFlatDepths_mm = 1e-3;  // depths that spread less than this are one depth

// The two logarithms that are searched.
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

KrigingHyper HyperOf(const Eigen::VectorXd& logs) { return {std::exp(logs[0]), std::exp(logs[1])}; }

// Of correlations, without nuggets.
double MisfitAt(const Kriging& options, KrigingData data, double length_mm) {
  data.nugget_mm2.setZero();
  return KrigingProcess(options.covariance, data, {length_mm, 1}).Misfit();
}

}  // namespace

std::vector<std::string> EndsInWords(std::span<const std::string_view> names,
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
    const KrigingProcess process(options.covariance, data, HyperOf(logs));
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
  KrigingHyper hyper = HyperOf(logs);
  hyper.at_end = EndsInWords(kNames, bounds, cost, logs);
  return hyper;
}

}  // namespace semblance
