// SPDX-License-Identifier: GPL-3.0-or-later
// The sphere nearest to scattered points, and the surface over it.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// With poles.
struct PolarSphere {
  Vec3 centre = Vec3::Constant(kNaN);  // mm
  Vec3 axis = Vec3::Constant(kNaN);    // unit; through the poles
  double radius_mm = kNaN;
};

// By linear least squares of |x - centre|^2 - radius^2 (Kasa). Points on a plane give a sphere
// that is far from them, or NaN.
//   points: mm, at least one; axis: of any length but 0, finite.
PolarSphere SphereThrough(std::span<const Vec3> points, const Vec3& axis);

// u: the azimuth around the axis in turns; v: the angle from the pole at -axis over pi, so that v
// grows along the axis and du x dv points outwards. Both in 0..1.
std::vector<Vec2> AnglesAbout(const PolarSphere& sphere, std::span<const Vec3> points);

// A ray from the centre, and how far the points keep away from it.
struct EmptyRay {
  Vec3 direction = Vec3::Constant(kNaN);  // unit
  double nearest_mm = kNaN;  // distance of the point next to it; infinite if all are behind
  double usual_mm = kNaN;    // median distance of all points from the line through it
  double Width() const { return nearest_mm / usual_mm; }
};

// The ray with the greatest width: of a sphere without a cap of half angle a that is sin(a) / 0.87
// (up to 90 degrees), of a tube with open ends 1, of what is closed next to nothing. It tries some
// hundred directions, and those that are given, both ways.
EmptyRay WidestRay(const PolarSphere& sphere, std::span<const Vec3> points,
                   std::span<const Vec3> directions);

// Places where a surface over (u,v) is one point along v = 0 and along v = 1, mm.
using Poles = std::array<Vec3, 2>;

// On the axis, as far from the centre as a quadratic in the angles says that goes through the
// distances of the points around the pole, outliers apart (Tukey's biweight). Exact for a sphere.
//   uv: of the points, by AnglesAbout.
Poles PolesOf(const PolarSphere& sphere, std::span<const Vec3> points, std::span<const Vec2> uv);

// The same of a surface of any form over the angles: each coordinate has such a quadratic.
Poles PolesAmong(std::span<const Vec3> points, std::span<const Vec2> uv);

}  // namespace semblance
