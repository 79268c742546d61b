// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces that are heights z over x and y. The unit of z may differ from that of x and y.
#pragma once

#include <optional>
#include <span>

#include "fitting/plan/fit_result.h"
#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::problems {

// The factor by which a fit multiplies z, so that the heights spread a quarter as far as the places
// and their unit has no effect on the fit. It follows from quantiles, so that a few gross errors
// have no effect either. Returns 1 if all heights are equal.
double HeightFactor(std::span<const Vec3> positions);

// Multiplies z of all positions.
void ScaleHeights(double factor, std::span<Vec3> positions);
// Multiplies z of a surface. Throws InputError unless its offsets lie along the axes of the world.
HSplineSurface WithScaledHeights(const HSplineSurface& surface, double factor);
// Multiplies the heights, and with them all distances, of a fit by the auto plan alone.
void ScaleHeights(double factor, FitResult& fit);

// The linear map from (x,y) to the (u,v) of a surface of heights.
class GraphMap {
 public:
  // Returns nothing if x and y of the surface are not linear in (u,v), or if they lie on a line.
  static std::optional<GraphMap> Of(const HSplineSurface& surface);

  Vec2 UvAt(const Vec2& xy) const { return uv_from_xy_ * (xy - origin_); }
  // The lengths of [0,1] along u and v, in the unit of x and y.
  Vec2 Lengths() const { return lengths_; }
  // The box of the domain in x and y.
  Eigen::AlignedBox2d Box() const { return box_; }

 private:
  Vec2 origin_ = Vec2::Zero(), lengths_ = Vec2::Constant(kNaN);
  Eigen::Matrix2d uv_from_xy_ = Eigen::Matrix2d::Identity();
  Eigen::AlignedBox2d box_;
};

}  // namespace semblance::problems
