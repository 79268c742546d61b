// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/moving_least_squares.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace semblance::interp {
namespace {

constexpr double kMinLogWeight = -40;  // log of weight over the nearest dowel's; smaller weights
                                       // have no effect

// Moments of the weighted samples, with positions relative to p, so that p is the origin.
struct Moments {
  double weight = 0;
  Vec3 position = Vec3::Zero();
  double depth = 0;
  Mat3 position_position = Mat3::Zero();
  Vec3 position_depth = Vec3::Zero();

  void Add(double w, const Vec3& x, double d) {
    weight += w;
    position += w * x;
    depth += w * d;
    position_position += w * x * x.transpose();
    position_depth += w * d * x;
  }
};

Moments MomentsAround(const std::vector<DepthSample>& samples, double width_mm, const Vec3& p) {
  double nearest2 = std::numeric_limits<double>::infinity();
  for (const DepthSample& sample : samples) {
    nearest2 = std::min(nearest2, (sample.base - p).squaredNorm());
  }
  Moments moments;
  for (const DepthSample& sample : samples) {
    const Vec3 x = sample.base - p;
    // Relative to the nearest dowel's weight, because far from all dowels the weights would vanish.
    const double log = (nearest2 - x.squaredNorm()) / (width_mm * width_mm);
    if (log > kMinLogWeight) {
      moments.Add(std::exp(log), x, sample.depth_mm);
    }
  }
  return moments;
}

double FitAtOrigin(const Moments& sums, double thin_mm) {
  const Vec3 center = sums.position / sums.weight;
  const double mean = sums.depth / sums.weight;
  const Mat3 spread = sums.position_position / sums.weight - center * center.transpose();
  const Vec3 with_depth = sums.position_depth / sums.weight - mean * center;
  const Vec3 slope = (spread + thin_mm * thin_mm * Mat3::Identity()).ldlt().solve(with_depth);
  return mean - slope.dot(center);
}

}  // namespace

DepthField InterpolateDepth(const MovingLeastSquares& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, options.clamp);
  return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
    const Moments sums = MomentsAround(samples, options.width_mm, input.skull.points[i]);
    return DepthValue{limits(FitAtOrigin(sums, options.thin_mm)), kNaN};
  });
}

}  // namespace semblance::interp
