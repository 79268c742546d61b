// SPDX-License-Identifier: GPL-3.0-or-later
// The dowels as scattered data, and what the schemes that need no network share.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"

namespace semblance {

// Points closer than this are one: two bases, or a vertex and a base, which then has the base's
// depth.
inline constexpr double kSamePoint_mm = 1e-6;

struct DepthSample {
  Vec3 base = Vec3::Constant(kNaN);
  Vec3 direction = Vec3::Constant(kNaN);  // unit
  double depth_mm = kNaN;
  double sd_mm = kNaN;  // NaN where there is none
};

// The dowels sorted by site, so that no result depends on their order, not even by rounding. Those
// whose bases are one point become one sample with the means of their values. At least one dowel.
std::vector<DepthSample> DepthSamples(std::span<const Dowel> dowels);

// A depth as a scheme may give it: within the samples' range if `clamp`; else only kept from
// falling below a tenth of the least sample, as a depth must be above 0.
class DepthLimits {
 public:
  DepthLimits(const std::vector<DepthSample>& samples, bool clamp);
  double operator()(double depth_mm) const;  // NaN stays NaN

 private:
  double least_mm_, most_mm_;
};

// The option behind it: alike for all schemes that can leave the dowels' range.
template <class Visitor>
void ClampField(Visitor& visit, bool& clamp) {
  visit(FieldInfo{.name = "clamp",
                  .doc = "keep the depth within the range of the dowels' depths; without, only "
                         "above a tenth of the least of them"},
        clamp);
}

struct DepthValue {
  double mm = kNaN;
  double sd_mm = kNaN;
};

// at(i) at each vertex that faces the dowels around it, kOutside where that has no depth,
// kNotFacing at the others. The direction of the dowels around a vertex is their mean, weighted by
// the inverse squared distance.
DepthField AssignWhereFacing(const DepthInput& input, const std::vector<DepthSample>& samples,
                             double max_angle_deg, const RunContext& run,
                             const std::function<DepthValue(std::size_t)>& at);

// Throws InputError, naming the scheme, if the skull has no triangle.
void CheckSurface(std::string_view scheme, const TriMesh& skull);

// Centre, size and directions of a set of points: what makes linear terms well-posed.
struct SampleFrame {
  Vec3 center = Vec3::Zero();
  double size_mm = 1;      // rms distance from the centre; 1 if all are in one point
  std::vector<Vec3> axes;  // the directions in which the points spread: 3, 2 (plane), 1, or 0
};

SampleFrame FrameOf(const std::vector<DepthSample>& samples);

}  // namespace semblance
