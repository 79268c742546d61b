// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/inverse_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "interp/dowel_samples.h"

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

}  // namespace

DepthField InterpolateDepth(const InverseDistance& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, true);
  return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
    const DepthValue mean = WeightedMean(samples, options.power, input.skull.points[i]);
    return DepthValue{limits(mean.mm), mean.sd_mm};  // against rounding
  });
}

}  // namespace semblance
