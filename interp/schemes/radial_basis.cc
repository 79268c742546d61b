// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/radial_basis.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "surfaces/base/error.h"

namespace semblance::interp {
namespace {

// The kernel of r, in units of the frame's size. The signs make every kernel conditionally positive
// definite, so that `smoothing` smooths.
double Kernel(RadialKernel kernel, double r, double width) {
  switch (kernel) {
    case RadialKernel::kLinear:
      return -r;
    case RadialKernel::kCubic:
      return r * r * r;
    case RadialKernel::kGaussian:
      return std::exp(-(r / width) * (r / width));
    case RadialKernel::kWendlandC2:
      break;
  }
  const double s = std::max(1 - r / width, 0.0);
  return s * s * s * s * (4 * r / width + 1);
}

class RadialField {
 public:
  RadialField(const RadialBasis& options, const std::vector<DepthSample>& samples)
      : kernel_(options.kernel), frame_(FindSampleFrame(samples)) {
    width_ = options.width_mm / frame_.size_mm;
    if (options.tail_degree == 0 && kernel_ != RadialKernel::kCubic) {
      frame_.axes.clear();
    }
    for (const DepthSample& sample : samples) {
      bases_.push_back(InFrame(sample.base));
    }
    Solve(options.smoothing, samples);
  }

  double operator()(const Vec3& p) const {
    const Vec3 q = InFrame(p);
    const auto n = static_cast<Eigen::Index>(bases_.size());
    double depth = weights_[n];
    for (Eigen::Index i = 0; i < n; ++i) {
      depth += weights_[i] * Kernel(kernel_, (bases_[i] - q).norm(), width_);
    }
    for (std::size_t k = 0; k < frame_.axes.size(); ++k) {
      depth += weights_[n + 1 + static_cast<Eigen::Index>(k)] * frame_.axes[k].dot(q);
    }
    return depth;
  }

 private:
  Vec3 InFrame(const Vec3& p) const { return (p - frame_.center) / frame_.size_mm; }

  // [K + smoothing I, P; P^T, 0] [weights; tail] = [depths; 0]
  void Solve(double smoothing, const std::vector<DepthSample>& samples) {
    const auto n = static_cast<Eigen::Index>(bases_.size());
    const auto axes = static_cast<Eigen::Index>(frame_.axes.size());
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + 1 + axes, n + 1 + axes);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n + 1 + axes);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        matrix(i, j) = Kernel(kernel_, (bases_[i] - bases_[j]).norm(), width_);
      }
      matrix(i, i) += smoothing;
      matrix(i, n) = matrix(n, i) = 1;
      for (Eigen::Index k = 0; k < axes; ++k) {
        matrix(i, n + 1 + k) = matrix(n + 1 + k, i) = frame_.axes[k].dot(bases_[i]);
      }
      right[i] = samples[i].depth_mm;
    }
    weights_ = Eigen::PartialPivLU<Eigen::MatrixXd>(matrix).solve(right);
    if (!weights_.allFinite()) {
      throw InputError(
          fmt::format("radial_basis: the equations of {} dowels have no finite solution; choose a "
                      "smaller width_mm, smoothing above 0 or the kernel linear",
                      n));
    }
  }

  RadialKernel kernel_;
  SampleFrame frame_;
  double width_ = 1;
  std::vector<Vec3> bases_;
  Eigen::VectorXd weights_;  // of kernels, constant, axes
};

}  // namespace

DepthField InterpolateDepth(const RadialBasis& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, options.clamp);
  const RadialField depth_at(options, samples);
  return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
    return DepthValue{limits(depth_at(input.skull.points[i])), kNaN};
  });
}

}  // namespace semblance::interp
