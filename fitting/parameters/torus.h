// SPDX-License-Identifier: GPL-3.0-or-later
// The torus nearest to scattered points.
#pragma once

#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// A tube around a circle, the ring. With h the height of a point x over the ring's plane and rho
// its distance from the axis, x is off by sqrt((rho - ring_mm)^2 + h^2) - tube_mm.
struct Torus {
  Vec3 centre = Vec3::Constant(kNaN);  // of the ring, mm
  Vec3 axis = Vec3::Constant(kNaN);    // unit; across the ring's plane
  double ring_mm = kNaN;               // radius of the ring
  double tube_mm = kNaN;               // radius of the tube; above ring_mm it crosses itself
  double median_off_mm = kNaN;         // of the points' distances from it
};

// By nonlinear least squares of the distances (Levenberg and Marquardt), with Cauchy's loss at the
// width of their median, so that outliers do not count; of at most 10,000 of the points, evenly
// chosen. It begins with the points' extents along and across an axis, with and without the
// outermost: the given axis, which then stays, or, if that is zero, each principal axis of the
// points. The nearest torus counts; an axis that was found has its largest entry positive.
//   points: mm, at least one; axis: of any length, finite.
// Points that are no torus give one that is far from them, or NaN.
Torus TorusThrough(std::span<const Vec3> points, const Vec3& axis);

// In turns, each in 0..1: u = atan2(x . b, x . a) around the axis, v = atan2(h, rho - ring_mm)
// around the ring, 0 on the outside; x from the centre, and a, b and the axis right-handed, so that
// du x dv points outwards.
std::vector<Vec2> TurnsAround(const Torus& torus, std::span<const Vec3> points);

}  // namespace semblance
