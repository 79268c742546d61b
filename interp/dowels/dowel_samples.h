// SPDX-License-Identifier: GPL-3.0-or-later
// The dowels as scattered data, and the common parts of the schemes that need no network.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"

namespace semblance::interp {

// Points closer than this count as one point. A vertex this close to a base gets the base's depth.
inline constexpr double kSamePoint_mm = 1e-6;

struct DepthSample {
  Vec3 base = Vec3::Constant(kNaN);
  Vec3 direction = Vec3::Constant(kNaN);  // unit
  double depth_mm = kNaN;
  double sd_mm = kNaN;  // NaN if unknown
};

// Sorts the dowels by site, so that no result depends on their order, not even by round-off. Dowels
// with the same base become one sample with the means of their values. Needs at least one dowel.
std::vector<DepthSample> DepthSamples(std::span<const Dowel> dowels);

// Limits a scheme's depth to the samples' range if `clamp`. Otherwise it only keeps the depth above
// a tenth of the smallest sample, because a depth must be above 0.
class DepthLimits {
 public:
  DepthLimits(const std::vector<DepthSample>& samples, bool clamp);
  double operator()(double depth_mm) const;  // NaN stays NaN

 private:
  double least_mm_, most_mm_;
};

// The common option of all schemes that can leave the dowels' range.
template <class Visitor>
void ClampField(Visitor& visit, bool& clamp) {
  visit(FieldInfo{.name = "clamp",
                  .doc = "limit depths to the range of the dowels' depths; if false, only to "
                         "values above a tenth of the smallest of them"},
        clamp);
}

struct DepthValue {
  double mm = kNaN;
  double sd_mm = kNaN;
};

// Assigns at(i) to each vertex i that faces the dowels around it, or kOutside if at(i) is NaN;
// other vertices get kNotFacing. The direction of the dowels around a vertex is their mean
// direction, weighted by the inverse squared distance.
DepthField AssignWhereFacing(const DepthInput& input, const std::vector<DepthSample>& samples,
                             double max_angle_deg, const RunContext& run,
                             const std::function<DepthValue(std::size_t)>& at);

// Throws InputError, with the scheme's name, if the skull has no triangle.
void CheckSurface(std::string_view scheme, const TriMesh& skull);

// Center, size and principal directions of a set of points. Linear terms are restricted to these
// directions, which keeps their equations solvable.
struct SampleFrame {
  Vec3 center = Vec3::Zero();
  double size_mm = 1;      // RMS distance from the center; 1 if all points coincide
  std::vector<Vec3> axes;  // directions in which the points spread: 3, 2 (a plane), 1 (a line) or 0
};

SampleFrame FindSampleFrame(const std::vector<DepthSample>& samples);

}  // namespace semblance::interp
