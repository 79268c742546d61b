// SPDX-License-Identifier: GPL-3.0-or-later
// A fit's points in the order of the patches that hold them, whatever the level.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/hspline_shape.h"

namespace semblance {

struct CloudPoint {
  double x = kNaN;  // u * patches_u of level 0, v * patches_v; in a patch of level L at
  double y = kNaN;  // x * 2^L - i, exactly as PatchPointAt has it
  std::array<double, 4> position{};  // mm; and a zero
  double weight = kNaN;              // of the target
};

// Sorted along a Z-curve through the level-0 patches, so that the points of any patch of any level
// stand together, and then by all their values: the order in which they are given has no effect.
class PointCloud {
 public:
  PointCloud(const HSplineShape& shape, const FitTarget& target);

  struct Range {
    std::size_t begin = 0, end = 0;
    std::size_t size() const { return end - begin; }
  };
  Range PatchOfLevel0(int i, int j) const;
  // The part of a patch's range that its child (level, i, j) holds.
  Range Child(const Range& parent, const PatchId& child) const;

  std::span<const CloudPoint> points() const { return points_; }
  std::span<const CloudPoint> Of(const Range& range) const {
    return std::span(points_).subspan(range.begin, range.size());
  }
  std::size_t Given(std::size_t k) const { return given_[k]; }  // its place in the target
  double weight_sum() const { return weight_sum_; }

 private:
  HSplineShape shape_;
  std::vector<CloudPoint> points_;
  std::vector<std::uint32_t> given_;
  std::vector<std::size_t> starts_;  // of each level-0 patch, and the end
  double weight_sum_ = 0;
};

}  // namespace semblance
