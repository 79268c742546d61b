// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle of the skull as its emission needs it, and how emission falls with distance. For the
// emitters' kernels alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/simd.h"
#include "surfaces/emitters/emitter.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

inline constexpr double kMostEmission = 1e12;  // of one triangle
inline constexpr double kRounding = 1e-9;      // share by which bounds are widened

// gain / distance^power, times the height over the triangle's plane where by_height; 0 where that
// is less than the cut, at most kMostEmission.
struct Falloff {
  double power = kNaN;  // > 0
  int whole = -1;       // the power if it is whole; -1: powers are taken one by one
  bool by_height = false;
  double cut = 0;

  double InversePower(double squared) const {
    return InversePowerOf<double>(squared, power, whole);
  }
  // For a gain of 1, without the cut, at least so far away and at most so high.
  double Most(double squared, double height) const {
    const double most = InversePower(squared);
    return by_height ? std::min(height, std::sqrt(squared)) * most : most;
  }
};
// whole is set if the power is whole.
inline Falloff MakeFalloff(double power, bool by_height, double cut) {
  return {power, power == std::floor(power) ? static_cast<int>(power) : -1, by_height, cut};
}

struct EmitterTriangle {
  Vec3 a, b, c;
  Vec3 centroid, normal;
  double area_mm2 = kNaN, depth_mm = kNaN;
  double longest2_mm2 = kNaN;  // squared length of the longest edge
  // Where the depth is linear over the triangle: its least and most at the corners, as shares of
  // depth_mm, which is their mean, and its gradient over depth_mm, in the plane; 1 / mm.
  double least_share = 1, most_share = 1;
  Vec3 slope = Vec3::Zero();
  // In the plane, out of the triangle, across ab, bc, ca.
  Vec3 edge_normal_a = Vec3::Constant(kNaN), edge_normal_b = edge_normal_a,
       edge_normal_c = edge_normal_a;

  // Set by its kernel.
  double gain = kNaN;         // the factor of its emission that does not depend on the point
  double most_gain = kNaN;    // the gain with the greatest of its depths
  Vec3 moved = Vec3::Zero();  // from the triangle to where it emits from

  bool IsSloped() const { return most_share > least_share; }

  // Distances closer than a share of the depth count as that, so that emission stays finite.
  double Floor2(double depth_share) const {
    constexpr double kClosest = 0.05;
    return std::pow(kClosest * depth_share * depth_mm, 2);
  }
};

// mm^2, from p to the triangle, not moved.
double SquaredDistance(const EmitterTriangle& t, const Vec3& p);
bool ProjectsOnto(const EmitterTriangle& t, const Vec3& p);

// One emitter per triangle that has depths and an area; several where the depth is linear over it
// and changes by more than 15 %. Throws InputError as ImplicitSurface does.
std::vector<EmitterTriangle> MakeEmitters(const TriMesh& skull, std::span<const double> depth_mm,
                                          EmitterDepth over_triangle);

}  // namespace semblance
