// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/inverse_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "interp/dowels/dowel_samples.h"

namespace semblance {
namespace {

DepthValue WeightedMean(const std::vector<DepthSample>& samples, double power, const Vec3& p) {
  double nearest2 = std::numeric_limits<double>::infinity();
  for (const DepthSample& sample : samples) {
    nearest2 = std::min(nearest2, (sample.base - p).squaredNorm());
  }
  // Relative to the nearest one, so that no power can overflow: the weights are in [0, 1], its own
  // is 1. With nearest2 = 0 all others are 0.
  double sum = 0, depth = 0, sd = 0;
  for (const DepthSample& sample : samples) {
    const double distance2 = (sample.base - p).squaredNorm();
    const double weight = distance2 == nearest2 ? 1 : std::pow(nearest2 / distance2, power / 2);
    sum += weight;
    depth += weight * sample.depth_mm;
    sd += weight * sample.sd_mm;
  }
  return {depth / sum, sd / sum};
}

struct Sums {
  double weight = 0, depth = 0, sd = 0;
  bool at_base = false;

  void Add(const DepthSample& sample, double distance_mm, double power) {
    if (at_base || !std::isfinite(distance_mm)) {
      return;
    }
    at_base = distance_mm <= kSamePoint_mm;
    if (at_base) {
      *this = {1, sample.depth_mm, sample.sd_mm, true};
      return;
    }
    const double w = std::pow(distance_mm, -power);
    weight += w;
    depth += w * sample.depth_mm;
    sd += w * sample.sd_mm;
  }
};

std::vector<Sums> SumsAlong(const DepthInput& input, const std::vector<DepthSample>& samples,
                            double power, const RunContext& run) {
  std::vector<Sums> sums(input.skull.points.size());
  ForEachGeodesic(InverseDistance::kName, input.skull, samples, run,
                  [&](std::size_t k, const std::vector<double>& distance) {
                    ForEachVertex(input, run, [&](std::size_t i) {
                      sums[i].Add(samples[k], distance[i], power);
                    });
                  });
  return sums;
}

}  // namespace

DepthField InterpolateDepth(const InverseDistance& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, true);
  if (options.distance == DowelDistance::kGeodesic) {
    const std::vector<Sums> sums = SumsAlong(input, samples, options.power, run);
    return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
      return DepthValue{limits(sums[i].depth / sums[i].weight), sums[i].sd / sums[i].weight};
    });
  }
  return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
    const DepthValue mean = WeightedMean(samples, options.power, input.skull.points[i]);
    return DepthValue{limits(mean.mm), mean.sd_mm};  // against rounding
  });
}

}  // namespace semblance
