// SPDX-License-Identifier: GPL-3.0-or-later
// How far a triangle is distorted that is laid on the unit sphere.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "surfaces/base/geometry.h"

namespace semblance {

// The shape that it is to keep: its corners are a, b and c.
struct TriangleInSpace {
  double cot_a = kNaN, cot_b = kNaN, cot_c = kNaN;  // of the angles
  double twice_area = kNaN;
};

// Thin triangles count as a hundredth of their longest edge's square: they have no shape to keep.
inline TriangleInSpace InSpace(const Vec3& a_to_b, const Vec3& a_to_c) {
  constexpr double kThinnest = 1e-2, kLeast = 1e-24;
  const Vec3 b_to_c = a_to_c - a_to_b;
  const double longest = std::max(
                   {a_to_b.squaredNorm(), a_to_c.squaredNorm(), b_to_c.squaredNorm(), kLeast}),
               twice = std::max(a_to_b.cross(a_to_c).norm(), kThinnest * longest);
  return {.cot_a = a_to_b.dot(a_to_c) / twice,
          .cot_b = -a_to_b.dot(b_to_c) / twice,
          .cot_c = a_to_c.dot(b_to_c) / twice,
          .twice_area = twice};
}

// The same triangle on the sphere, as a function of its corner a. Its area is that of its shadow on
// the plane through b and c that looks outwards, which changes its sign where the triangle turns
// over.
class TriangleOnSphere {
 public:
  TriangleOnSphere(const TriangleInSpace& in_space, const Vec3& b, const Vec3& c)
      : in_space_(in_space), b_(b), c_(c), opposite_(in_space.cot_a * (c - b).squaredNorm() / 2) {}

  double TwiceArea(const Vec3& a) const { return a.dot((b_ - a).cross(c_ - a)); }

  // The symmetric Dirichlet energy D (1 + (A / a)^2), with the area A in space and a here, and
  // Dirichlet's energy D, half the sum of each edge's square times the cotangent of the angle that
  // it faces (Pinkall & Polthier 1993). Infinite where it is turned over or has no area.
  double Energy(const Vec3& a) const {
    const double twice = TwiceArea(a);
    return twice > 0 ? Dirichlet(a) * (1 + Square(in_space_.twice_area / twice))
                     : std::numeric_limits<double>::infinity();
  }

  // Adds the derivatives of the energy by a.
  void AddDerivatives(const Vec3& a, Vec3& gradient, Mat3& hessian) const {
    const auto& [cot_a, cot_b, cot_c, twice_in_space] = in_space_;
    const double twice = TwiceArea(a), dirichlet = Dirichlet(a),
                 ratio = Square(twice_in_space / twice);
    const Vec3 slope = cot_c * (a - b_) + cot_b * (a - c_), area_slope = b_.cross(c_);
    gradient += (1 + ratio) * slope - 2 * ratio * dirichlet / twice * area_slope;
    const Mat3 mixed = slope * area_slope.transpose();
    hessian += (cot_b + cot_c) * (1 + ratio) * Mat3::Identity() -
               2 * ratio / twice * (mixed + mixed.transpose()) +
               6 * ratio * dirichlet / Square(twice) * area_slope * area_slope.transpose();
  }

 private:
  static double Square(double x) { return x * x; }
  double Dirichlet(const Vec3& a) const {
    return opposite_ +
           (in_space_.cot_b * (c_ - a).squaredNorm() + in_space_.cot_c * (b_ - a).squaredNorm()) /
               2;
  }

  TriangleInSpace in_space_;
  Vec3 b_, c_;
  double opposite_;  // of the edge that does not move
};

}  // namespace semblance
