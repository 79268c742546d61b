// SPDX-License-Identifier: GPL-3.0-or-later
// The points of a fit in an order in which the points of every patch of every level stand together.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/hspline_shape.h"

namespace semblance::fitting {

// A point that a surface should meet: S(uv) should equal `position`.
struct Observation {
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  Vec3 position = Vec3::Constant(kNaN);  // mm
  double weight = 1;                     // > 0, relative to the other points
  bool landmark = false;                 // a standard landmark, for LandmarkTerm
};

struct CloudPoint {
  // u * patches_u and v * patches_v of level 0. In patch (i, j) of level L the place is (x 2^L - i,
  // y 2^L - j), exactly as computed by PatchPointAt.
  double x = kNaN, y = kNaN;
  // Position in mm, and the weight: one load of four lanes.
  std::array<double, 4> values = {kNaN, kNaN, kNaN, kNaN};

  double weight() const { return values[3]; }
};

// The order of points along the curve of PointCloud, as indices. It does not depend on the given
// order.
std::vector<std::uint32_t> CurveOrder(const HSplineShape& shape, const ScatteredPoints& points);

// Points sorted by level-0 patch, then along a Z-curve in the patch (for a surface with one level
// by u, then v), and then by all their values. The points of any patch of any level stand together,
// and the given order has no effect.
class PointCloud {
 public:
  PointCloud(const HSplineShape& shape, const FitTarget& target);
  PointCloud(const HSplineShape& shape, std::span<const Observation> observations);

  struct Range {
    std::size_t begin = 0, end = 0;
    std::size_t size() const { return end - begin; }
  };
  Range PatchOfLevel0(int i, int j) const;
  // The part of a patch's range that lies in its child (level, i, j).
  Range Child(const Range& parent, const PatchId& child) const;

  std::span<const CloudPoint> points() const { return points_; }
  std::span<const CloudPoint> Of(const Range& range) const {
    return std::span(points_).subspan(range.begin, range.size());
  }
  std::size_t Given(std::size_t k) const { return given_[k]; }  // given index of point k
  double weight_sum() const { return weight_sum_; }

 private:
  template <class Points>
  void Fill(const Points& given);

  HSplineShape shape_;
  std::vector<CloudPoint> points_;
  std::vector<std::uint32_t> given_;
  std::vector<std::size_t> starts_;  // first point of each level-0 patch, and the end
  double weight_sum_ = 0;
};

}  // namespace semblance::fitting
