// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/variogram.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace semblance::interp {
namespace {

constexpr int kPoints = 1500;

// A sampled point and its weight.
struct Taken {
  std::size_t point = 0;
  double weight = 0;
};

// All points with a weight; if there are too many, those at equal steps of the cumulative weight.
std::vector<Taken> EvenlyByWeight(std::span<const double> values, std::span<const double> weights) {
  const auto weight = [&](std::size_t k) {
    return !std::isfinite(values[k]) ? 0.0 : weights.empty() ? 1.0 : weights[k];
  };
  double total = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    total += weight(k);
    count += weight(k) > 0 ? 1 : 0;
  }
  const bool all = count <= kPoints;
  const double step = total / kPoints;
  std::vector<Taken> taken;
  double sum = 0, steps = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!(weight(k) > 0)) {
      continue;
    }
    sum += weight(k);
    const double before = steps;
    while (sum >= (steps + 0.5) * step) {
      ++steps;
    }
    if (const double counts = all ? weight(k) : steps - before; counts > 0) {
      taken.push_back({k, counts});
    }
  }
  return taken;
}

// Fits nugget and sill for a length by reweighted least squares; a negative value becomes 0.
VariogramModel FitAt(double length_mm, std::span<const VariogramBin> bins) {
  VariogramModel model{.nugget_mm2 = 0, .sill_mm2 = 0, .length_mm = length_mm};
  std::vector<double> now;
  for (const VariogramBin& bin : bins) {
    now.push_back(std::max(bin.semivariance_mm2, 1e-12));
  }
  for (int round = 0; round < 10; ++round) {
    double s11 = 0, s12 = 0, s22 = 0, r1 = 0, r2 = 0;
    for (std::size_t k = 0; k < bins.size(); ++k) {
      const double w = static_cast<double>(bins[k].pairs) / (now[k] * now[k]),
                   rise = -std::expm1(-bins[k].distance_mm / length_mm);
      s11 += w, s12 += w * rise, s22 += w * rise * rise;
      r1 += w * bins[k].semivariance_mm2, r2 += w * rise * bins[k].semivariance_mm2;
    }
    const double determinant = s11 * s22 - s12 * s12;
    model.nugget_mm2 = determinant > 0 ? (s22 * r1 - s12 * r2) / determinant : 0;
    model.sill_mm2 = determinant > 0 ? (s11 * r2 - s12 * r1) / determinant : r2 / s22;
    if (model.nugget_mm2 < 0) {
      model.nugget_mm2 = 0, model.sill_mm2 = r2 / s22;
    } else if (model.sill_mm2 < 0) {
      model.nugget_mm2 = r1 / s11, model.sill_mm2 = 0;
    }
    for (std::size_t k = 0; k < bins.size(); ++k) {
      now[k] = std::max(model.At(bins[k].distance_mm), 1e-12);
    }
  }
  return model;
}

double RelativeMisfit(const VariogramModel& model, std::span<const VariogramBin> bins) {
  double sum = 0;
  for (const VariogramBin& bin : bins) {
    const double off = bin.semivariance_mm2 / std::max(model.At(bin.distance_mm), 1e-12) - 1;
    sum += static_cast<double>(bin.pairs) * off * off;
  }
  return sum;
}

}  // namespace

double VariogramModel::At(double distance_mm) const {
  return nugget_mm2 - sill_mm2 * std::expm1(-distance_mm / length_mm);
}

std::vector<VariogramBin> EmpiricalVariogram(std::span<const Vec3> points,
                                             std::span<const double> values,
                                             std::span<const double> weights, double bin_mm,
                                             double reach_mm) {
  const std::vector<Taken> taken = EvenlyByWeight(values, weights);
  const auto count = static_cast<std::size_t>(std::ceil(reach_mm / bin_mm));
  std::vector<VariogramBin> bins(count, {.distance_mm = 0, .semivariance_mm2 = 0});
  std::vector<double> sums(count, 0);  // sums of weights
  for (std::size_t i = 0; i < taken.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const auto& [a, weight_a] = taken[i];
      const auto& [b, weight_b] = taken[j];
      const double distance_mm = (points[a] - points[b]).norm();
      const auto k = static_cast<std::size_t>(distance_mm / bin_mm);
      if (distance_mm < reach_mm && k < count) {
        const double difference = values[a] - values[b], weight = weight_a * weight_b;
        bins[k].distance_mm += weight * distance_mm;
        bins[k].semivariance_mm2 += weight * difference * difference / 2;
        sums[k] += weight;
        ++bins[k].pairs;
      }
    }
  }
  for (std::size_t k = 0; k < count; ++k) {
    bins[k].distance_mm /= sums[k];
    bins[k].semivariance_mm2 /= sums[k];
  }
  std::erase_if(bins, [](const VariogramBin& bin) { return bin.pairs == 0; });
  return bins;
}

VariogramModel FitVariogram(std::span<const VariogramBin> bins) {
  const bool any =
      std::ranges::any_of(bins, [](const VariogramBin& bin) { return bin.semivariance_mm2 > 0; });
  VariogramModel best;
  if (bins.size() < 3 || !any) {
    return best;
  }
  constexpr int kLengths = 60;
  const double first = std::max(bins.front().distance_mm, 1e-6),
               ratio = std::pow(3 * bins.back().distance_mm / first, 1.0 / (kLengths - 1));
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kLengths; ++k) {
    const VariogramModel model = FitAt(first * std::pow(ratio, k), bins);
    if (const double misfit = RelativeMisfit(model, bins); misfit < least) {
      least = misfit;
      best = model;
    }
  }
  return best;
}

}  // namespace semblance::interp
