// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/plan/pole_points.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "fitting/nested/nested_points.h"

namespace semblance {
namespace {

double MeanOf(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double RmsOf(std::span<const double> distances, std::span<const double> weights) {
  double sum = 0, all = 0;
  for (std::size_t k = 0; k < distances.size(); ++k) {
    const double weight = weights.empty() ? 1 : weights[k];
    sum += weight * distances[k] * distances[k];
    all += weight;
  }
  return std::sqrt(sum / all);
}

}  // namespace

std::size_t AddPolePoints(const Poles& poles, OwnedPoints& points) {
  const auto count =
      static_cast<int>(std::ceil(std::sqrt(static_cast<double>(points.uv.size())) / 2));
  const double weight = points.weights.empty() ? kNaN : MeanOf(points.weights);
  for (const int pole : {0, 1}) {
    for (int k = 0; k < count; ++k) {
      points.positions.push_back(poles[pole]);
      points.uv.emplace_back((k + 0.5) / count, pole);
      if (!points.weights.empty()) {
        points.weights.push_back(weight);
      }
    }
  }
  return 2 * static_cast<std::size_t>(count);
}

void ForgetLastPoints(std::size_t added, std::span<const double> weights, FitResult& fit) {
  const std::size_t count = fit.residual_mm.size() - added;
  fit.residual_mm.resize(count);
  fit.uv.resize(count);
  fit.point_rms_mm = fit.dowel_rms_mm = RmsOf(fit.residual_mm, weights);
  if (fit.automatic) {
    const auto is_added = [&](std::uint32_t k) { return k >= count; };
    std::erase_if(fit.automatic->outliers, is_added);
    std::erase_if(fit.automatic->repeated, is_added);
  }
}

}  // namespace semblance
