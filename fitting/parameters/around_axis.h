// SPDX-License-Identifier: GPL-3.0-or-later
// Angles around an axis.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "surfaces/base/geometry.h"

namespace semblance {

// Two unit directions across a unit axis; right-handed with it.
inline std::array<Vec3, 2> Across(const Vec3& axis) {
  Eigen::Index least = 0;
  axis.cwiseAbs().minCoeff(&least);
  const Vec3 a = axis.cross(Vec3::Unit(least)).normalized();
  return {a, axis.cross(a)};
}

// The angle of (x, y) in turns, in 0..1.
inline double Turns(double y, double x) {
  const double turns = std::atan2(y, x) / (2 * std::numbers::pi);
  return turns < 0 ? std::min(turns + 1, 1.0) : turns;
}

}  // namespace semblance
