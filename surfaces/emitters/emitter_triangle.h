// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle of the skull with the data of its emission, and the decrease of emission with
// distance. Used by the emitters' kernels only.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/simd.h"
#include "surfaces/emitters/emitter.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

inline constexpr double kMaxEmission = 1e12;  // cap on one triangle's emission
inline constexpr double kRounding = 1e-9;     // relative widening of bounds against round-off

// The decrease of emission: gain / distance^power, times the height over the triangle's plane if
// by_height. Values below `cut` are 0, and values are at most kMaxEmission.
struct Falloff {
  double power = kNaN;  // > 0
  int whole = -1;       // the power if it is an integer, else -1
  bool by_height = false;
  double cut = 0;

  double InversePower(double squared) const {
    return InversePowerFromSquare<double>(squared, power, whole);
  }
  // The largest value for a gain of 1 and no cut, at this squared distance or beyond and at this
  // height or below.
  double Most(double squared, double height) const {
    const double most = InversePower(squared);
    return by_height ? std::min(height, std::sqrt(squared)) * most : most;
  }
};
// Sets `whole` if the power is an integer.
inline Falloff MakeFalloff(double power, bool by_height, double cut) {
  return {power, power == std::floor(power) ? static_cast<int>(power) : -1, by_height, cut};
}

struct EmitterTriangle {
  Vec3 a, b, c;
  Vec3 centroid, normal;
  double area_mm2 = kNaN, depth_mm = kNaN;
  double longest2_mm2 = kNaN;  // squared longest edge
  // For a linear depth: its least and largest value at the corners, relative to their mean
  // depth_mm, and its gradient in the plane, divided by depth_mm, in 1/mm.
  double least_share = 1, most_share = 1;
  Vec3 slope = Vec3::Zero();
  // Vectors in the plane, perpendicular to ab, bc and ca, out of the triangle.
  Vec3 edge_normal_a = Vec3::Constant(kNaN), edge_normal_b = edge_normal_a,
       edge_normal_c = edge_normal_a;

  // Set for the emitter's kernel.
  double gain = kNaN;         // the factor of the emission that is independent of the point
  double most_gain = kNaN;    // the gain with the largest depth of the triangle
  Vec3 moved = Vec3::Zero();  // from the triangle to its place of emission

  bool IsSloped() const { return most_share > least_share; }

  // The smallest squared distance that counts; smaller ones count as this one, so that emission
  // stays finite. 5 % of the depth lies far below the surface, at emissions of about 20^k.
  double Floor2(double depth_share) const {
    constexpr double kClosest = 0.05;
    return std::pow(kClosest * depth_share * depth_mm, 2);
  }
};

// Squared distance from p to the triangle (not moved), mm^2.
double SquaredDistance(const EmitterTriangle& t, const Vec3& p);
bool ProjectsOnto(const EmitterTriangle& t, const Vec3& p);

// Makes one emitter per triangle with depths and an area, or several if the depth is linear over
// the triangle and changes by more than 15 %. Throws InputError as ImplicitSurface does.
std::vector<EmitterTriangle> MakeEmitters(const TriMesh& skull, std::span<const double> depth_mm,
                                          EmitterDepth over_triangle);

}  // namespace semblance::surfaces
