// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/stacking/sd_by_distance.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace semblance {
namespace {

constexpr std::size_t kFewest = 3;               // errors
constexpr double kNearest = 0.1, kFurthest = 2;  // of the mean distance
constexpr double kHalfWithin = 0.6744897501960817;

}  // namespace

double SdByDistance::At(double to_nearest_mm) const {
  return scale_mm * std::sqrt(std::clamp(to_nearest_mm / distance_mm, kNearest, kFurthest));
}

SdByDistance FitSdByDistance(std::span<const double> errors_mm,
                             std::span<const double> distances_mm) {
  SdByDistance unit{.scale_mm = 1, .distance_mm = 0};
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < errors_mm.size(); ++i) {
    if (std::isfinite(errors_mm[i]) && std::isfinite(distances_mm[i])) {
      known.push_back(i);
      unit.distance_mm += distances_mm[i];
    }
  }
  if (known.size() < kFewest || !(unit.distance_mm > 0)) {
    return {};
  }
  unit.distance_mm /= static_cast<double>(known.size());
  std::vector<double> ratios;
  for (const std::size_t i : known) {
    ratios.push_back(std::abs(errors_mm[i]) / unit.At(distances_mm[i]));
  }
  std::ranges::sort(ratios);
  const std::size_t half = ratios.size() / 2;
  const double median =
      ratios.size() % 2 == 1 ? ratios[half] : (ratios[half - 1] + ratios[half]) / 2;
  return {median / kHalfWithin, unit.distance_mm};
}

}  // namespace semblance
