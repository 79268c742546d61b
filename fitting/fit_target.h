// SPDX-License-Identifier: GPL-3.0-or-later
// What a surface is fitted to: points, each with the (u,v) at which the surface should meet it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "surfaces/geometry.h"

namespace semblance {

struct FitPoint {
  std::string label;  // site of a dowel, or the name of a seeded one; for reports
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  double weight = 1;                     // > 0; relative to the other points
};

struct FitTarget {
  std::vector<FitPoint> points;
};

// Throws InputError, naming the point, if one has a position that is not finite, a (u,v) outside
// the domain or a weight that is not positive and finite.
void CheckTarget(const FitTarget& target);

}  // namespace semblance
