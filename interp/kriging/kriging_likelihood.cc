// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/kriging_likelihood.h"

#include <algorithm>
#include <cmath>

#include "interp/kriging/bounded_minimum.h"

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

}  // namespace

double DepthSpread(const Eigen::VectorXd& depth_mm) {
  const double mean = depth_mm.mean();
  return std::max(std::sqrt((depth_mm.array() - mean).square().mean()), kFlatDepths_mm);
}

KrigingHyper FitHyper(const Kriging& options, const KrigingData& data, const RunContext& run) {
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
  return HyperOf(FindMinimum(SearchBounds(options, data), cost, run));
}

}  // namespace semblance
