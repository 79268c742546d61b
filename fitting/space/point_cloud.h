// SPDX-License-Identifier: GPL-3.0-or-later
// A fit's points, in the order of the patches that hold them, whatever the level.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/hspline_shape.h"

namespace semblance {

// One point that a surface should meet: at uv it is to be at `position`.
struct Observation {
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  Vec3 position = Vec3::Constant(kNaN);  // mm
  double weight = 1;                     // > 0, relative to the other points
  bool landmark = false;                 // a standard one, for LandmarkTerm
};

struct CloudPoint {
  double x = kNaN;  // u * patches_u of level 0, v * patches_v; in a patch of level L at
  double y = kNaN;  // x * 2^L - i, exactly as PatchPointAt has it
  // Position in mm, and the weight: what four lanes take at once.
  std::array<double, 4> values = {kNaN, kNaN, kNaN, kNaN};

  double weight() const { return values[3]; }
};

// The order of points along the curve of PointCloud, as indices; that in which they are given has
// no effect on what follows what.
std::vector<std::uint32_t> CurveOrder(const HSplineShape& shape, const ScatteredPoints& points);

// Sorted along a Z-curve through the level-0 patches, so that the points of any patch of any level
// stand together (of a surface with one level by u, then v), and then by all their values: the
// order in which they are given has no effect.
class PointCloud {
 public:
  PointCloud(const HSplineShape& shape, const FitTarget& target);
  PointCloud(const HSplineShape& shape, std::span<const Observation> observations);

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
  std::size_t Given(std::size_t k) const { return given_[k]; }  // its index as given
  double weight_sum() const { return weight_sum_; }

 private:
  template <class Points>
  void Fill(const Points& given);

  HSplineShape shape_;
  std::vector<CloudPoint> points_;
  std::vector<std::uint32_t> given_;
  std::vector<std::size_t> starts_;  // of each level-0 patch, and the end
  double weight_sum_ = 0;
};

}  // namespace semblance
