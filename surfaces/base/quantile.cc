// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/quantile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace semblance::surfaces {

double ArithmeticMean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::vector<WeightedValue> SortedValues(std::span<const double> values,
                                        std::span<const double> weights) {
  std::vector<WeightedValue> sorted;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (std::isfinite(values[k])) {
      sorted.push_back({values[k], weights.empty() ? 1 : weights[k]});
    }
  }
  std::ranges::stable_sort(sorted, {}, &WeightedValue::value);
  return sorted;
}

double Quantile(std::span<const WeightedValue> sorted, double share) {
  double all = 0;
  for (const WeightedValue& v : sorted) {
    all += v.weight;
  }
  const double wanted = share * all, rounding = 1e-12 * all;
  double below = 0, last = std::numeric_limits<double>::quiet_NaN();
  bool met = false;  // the weight up to `last` equals the share
  for (const auto& [value, weight] : sorted) {
    if (weight > 0) {
      if (met) {
        return (last + value) / 2;
      }
      below += weight;
      if (below > wanted + rounding) {
        return value;
      }
      met = below >= wanted - rounding;
      last = value;
    }
  }
  return last;
}

double Quantile(std::vector<double>& values, double share) {
  if (values.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto count = static_cast<double>(values.size());
  const double wanted = share * count, whole = std::round(wanted);
  const bool is_met = std::abs(wanted - whole) <= 1e-12 * count;  // exactly between two values
  const auto below = static_cast<std::size_t>(is_met ? whole : std::floor(wanted));
  const std::size_t at = std::min(below, values.size() - 1);
  std::ranges::nth_element(values, values.begin() + static_cast<long>(at));
  if (!is_met || below == 0 || below == values.size()) {
    return values[at];
  }
  return (*std::max_element(values.begin(), values.begin() + static_cast<long>(at)) + values[at]) /
         2;
}

double UpperMedian(std::vector<double>& values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace semblance::surfaces
