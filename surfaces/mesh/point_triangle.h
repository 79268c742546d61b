// SPDX-License-Identifier: GPL-3.0-or-later
// The closest point of one triangle, for the few triangles that need no search tree.
#pragma once

#include "surfaces/base/geometry.h"

namespace semblance {

struct TrianglePoint {
  Vec3 position = Vec3::Constant(kNaN);  // on the triangle, mm
  Vec3 weights = Vec3::Constant(kNaN);   // of the corners a, b, c; >= 0, sum 1
};

// Also for triangles without area: the closest point of their edges. All points must be finite.
TrianglePoint ClosestPointOnTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace semblance
