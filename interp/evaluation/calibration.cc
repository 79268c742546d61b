// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/calibration.h"

#include <cmath>
#include <numbers>

#include "surfaces/base/geometry.h"

namespace semblance {
namespace {

constexpr int kLevels = 19;  // of 5 % each
constexpr double kRounding = 1e-9;

}  // namespace

double ShareAround(double error, double sd) {
  if (sd > 0) {
    return std::erf(std::abs(error) / (sd * std::numbers::sqrt2));
  }
  return std::abs(error) <= kRounding ? 0 : 1;
}

std::vector<double> Coverage(std::span<const double> errors, std::span<const double> sds,
                             std::span<const double> weights) {
  std::vector<double> within(kLevels, 0);
  double all = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!std::isfinite(errors[i]) || !std::isfinite(sds[i])) {
      continue;
    }
    const double weight = weights.empty() ? 1 : weights[i], share = ShareAround(errors[i], sds[i]);
    all += weight;
    for (int k = 0; k < kLevels; ++k) {
      within[k] += share <= (k + 1) / 20.0 ? weight : 0;
    }
  }
  if (!(all > 0)) {
    return {};
  }
  for (double& share : within) {
    share /= all;
  }
  return within;
}

double CoverageAt90(const std::vector<double>& coverage) {
  return coverage.empty() ? kNaN : coverage[17];
}

}  // namespace semblance
