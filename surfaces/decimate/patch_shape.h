// SPDX-License-Identifier: GPL-3.0-or-later
// Whether the triangles around an edge stay sound triangles when it collapses.
#pragma once

#include "surfaces/decimate/patch_places.h"

namespace semblance {

// No triangle turns by more than 60 degrees, or becomes a needle where there was none: the least of
// 4 sqrt(3) area / (sum of squared sides) is at least 0.05, or no less than it was. A triangle
// without area before has no side of its own and takes that of all.
bool KeepsShape(const PatchPlaces& patch);

// The sum of the new triangles' area vectors, mm^2.
Vec3 AreaVectorAfter(const PatchPlaces& patch);

}  // namespace semblance
