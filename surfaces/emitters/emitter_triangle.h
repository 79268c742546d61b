// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle of the skull as its emission needs it. For the emitters' kernels alone.
#pragma once

#include <algorithm>
#include <cmath>

#include "surfaces/base/geometry.h"

namespace semblance {

inline constexpr double kMostEmission = 1e12;  // of one triangle
inline constexpr double kRounding = 1e-9;      // share by which bounds are widened

// r^-n from r^2. Whole n, the usual case, needs no pow.
class InversePower {
 public:
  explicit InversePower(double n) : n_(n), whole_(n == std::floor(n) ? static_cast<int>(n) : -1) {}
  double operator()(double r2) const {
    if (whole_ < 0) {
      return std::pow(r2, -0.5 * n_);
    }
    const double inverse2 = 1 / r2;
    double result = whole_ & 1 ? std::sqrt(inverse2) : 1;
    double power = inverse2;
    for (int rest = whole_ >> 1; rest != 0; rest >>= 1, power *= power) {
      result *= rest & 1 ? power : 1;
    }
    return result;
  }

 private:
  double n_;
  int whole_;
};

// One triangle of the skull as its emission needs it.
struct EmitterTriangle {
  Vec3 a, b, c;
  Vec3 centroid, normal;
  double area_mm2 = kNaN, depth_mm = kNaN;
  double longest2_mm2 = kNaN;  // squared length of the longest edge
  double gain = kNaN;          // the factor of its emission that does not depend on the point
  double most_gain = kNaN;     // with the most of its depths
  Vec3 moved = Vec3::Zero();   // to where it is that it emits from
  // Where the depth is linear over the triangle: its least and most at the corners, as shares of
  // depth_mm, which is their mean, and its gradient over depth_mm, in the plane; 1 / mm.
  double least_share = 1, most_share = 1;
  Vec3 slope = Vec3::Zero();
  // In the plane, out of the triangle, across ab, bc, ca.
  Vec3 edge_normal_a = Vec3::Constant(kNaN), edge_normal_b = edge_normal_a,
       edge_normal_c = edge_normal_a;

  bool IsSloped() const { return most_share > least_share; }

  // Distances closer than a share of the depth count as that, so that emission stays finite.
  double Floor2(double depth_share) const {
    constexpr double kClosest = 0.05;
    return std::pow(kClosest * depth_share * depth_mm, 2);
  }
};

// From p to the triangle, wherever it was moved to.
inline double SquaredDistance(const EmitterTriangle& t, const Vec3& p) {
  const Vec3 ap = p - t.a, bp = p - t.b, cp = p - t.c;
  const double out_ab = ap.dot(t.edge_normal_a), out_bc = bp.dot(t.edge_normal_b),
               out_ca = cp.dot(t.edge_normal_c);
  if (out_ab <= 0 && out_bc <= 0 && out_ca <= 0) {
    const double h = ap.dot(t.normal);
    return h * h;
  }
  const auto to_segment = [&p](const Vec3& u, const Vec3& v) {
    const Vec3 uv = v - u;
    const double s = std::clamp((p - u).dot(uv) / uv.squaredNorm(), 0.0, 1.0);
    return (p - u - s * uv).squaredNorm();
  };
  return std::min({to_segment(t.a, t.b), to_segment(t.b, t.c), to_segment(t.c, t.a)});
}

inline bool ProjectsOnto(const EmitterTriangle& t, const Vec3& p) {
  return (p - t.a).dot(t.edge_normal_a) <= 0 && (p - t.b).dot(t.edge_normal_b) <= 0 &&
         (p - t.c).dot(t.edge_normal_c) <= 0;
}

}  // namespace semblance
