// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/dowel_samples.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "surfaces/base/error.h"

namespace semblance::interp {
namespace {

constexpr double kMinDepthShare = 0.1;  // of the smallest depth, without clamp; any small positive
                                        // share would do
constexpr double kFlatSpread = 1e-3;    // relative; points flatter than this form a plane or a line

bool Before(const Dowel& a, const Dowel& b) {
  const auto key = [](const Dowel& d) {
    return std::tuple(d.site, d.base.x(), d.base.y(), d.base.z(), d.depth_mm);
  };
  return key(a) < key(b);
}

// The mean of dowels with the same base.
DepthSample Merged(const std::vector<Dowel>& same) {
  const auto count = static_cast<double>(same.size());
  DepthSample mean{same.front().base, Vec3::Zero(), 0, 0};
  for (const Dowel& dowel : same) {
    mean.direction += dowel.direction;
    mean.depth_mm += dowel.depth_mm / count;
    mean.sd_mm += dowel.sd_mm / count;
  }
  mean.direction.normalize();
  return mean;
}

Vec3 DirectionAround(const std::vector<DepthSample>& samples, const Vec3& p) {
  Vec3 sum = Vec3::Zero();
  for (const DepthSample& sample : samples) {
    const double distance2 = (sample.base - p).squaredNorm();
    if (distance2 <= kSamePoint_mm * kSamePoint_mm) {
      return sample.direction;
    }
    sum += sample.direction / distance2;
  }
  return sum.normalized();
}

}  // namespace

std::vector<DepthSample> DepthSamples(std::span<const Dowel> dowels) {
  std::vector<Dowel> sorted(dowels.begin(), dowels.end());
  std::ranges::sort(sorted, Before);
  std::vector<std::vector<Dowel>> groups;  // one group per base
  for (const Dowel& dowel : sorted) {
    auto it = std::ranges::find_if(groups, [&](const std::vector<Dowel>& group) {
      return (group.front().base - dowel.base).squaredNorm() <= kSamePoint_mm * kSamePoint_mm;
    });
    if (it == groups.end()) {
      it = groups.insert(it, std::vector<Dowel>());
    }
    it->push_back(dowel);
  }
  std::vector<DepthSample> samples(groups.size());
  std::ranges::transform(groups, samples.begin(), Merged);
  return samples;
}

DepthLimits::DepthLimits(const std::vector<DepthSample>& samples, bool clamp) {
  const auto [least, most] = std::ranges::minmax_element(samples, {}, &DepthSample::depth_mm);
  least_mm_ = clamp ? least->depth_mm : kMinDepthShare * least->depth_mm;
  most_mm_ = clamp ? most->depth_mm : std::numeric_limits<double>::infinity();
}

double DepthLimits::operator()(double depth_mm) const {
  return std::isnan(depth_mm) ? kNaN : std::clamp(depth_mm, least_mm_, most_mm_);
}

DepthField AssignWhereFacing(const DepthInput& input, const std::vector<DepthSample>& samples,
                             double max_angle_deg, const RunContext& run,
                             const std::function<DepthValue(std::size_t)>& at) {
  DepthField field = EmptyDepthField(input.skull.points.size());
  ForEachVertex(input, run, [&](std::size_t i) {
    const bool always = max_angle_deg >= 180;
    if (!always &&
        !Faces(input.normals[i], DirectionAround(samples, input.skull.points[i]), max_angle_deg)) {
      field.status[i] = DepthStatus::kNotFacing;
      return;
    }
    const DepthValue value = at(i);
    field.status[i] = std::isnan(value.mm) ? DepthStatus::kOutside : DepthStatus::kAssigned;
    field.depth_mm[i] = value.mm;
    field.sd_mm[i] = value.sd_mm;
  });
  return field;
}

void CheckSurface(std::string_view scheme, const TriMesh& skull) {
  if (skull.triangles.empty()) {
    throw InputError(
        fmt::format("{}: the skull has {} vertices and no triangle, but this scheme works along "
                    "its surface; give a mesh or choose a scheme in space",
                    scheme, skull.points.size()));
  }
}

SampleFrame FindSampleFrame(const std::vector<DepthSample>& samples) {
  SampleFrame frame;
  for (const DepthSample& sample : samples) {
    frame.center += sample.base / static_cast<double>(samples.size());
  }
  Mat3 spread = Mat3::Zero();
  for (const DepthSample& sample : samples) {
    const Vec3 from_center = sample.base - frame.center;
    spread += from_center * from_center.transpose() / static_cast<double>(samples.size());
  }
  const double size = std::sqrt(spread.trace());
  if (size <= kSamePoint_mm) {
    return frame;
  }
  frame.size_mm = size;
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(spread);
  for (int k = 2; k >= 0; --k) {
    if (eigen.eigenvalues()[k] > kFlatSpread * kFlatSpread * size * size) {
      frame.axes.push_back(eigen.eigenvectors().col(k));
    }
  }
  return frame;
}

}  // namespace semblance::interp
