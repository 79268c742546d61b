// SPDX-License-Identifier: GPL-3.0-or-later
// Points spread evenly over a set of points.
#pragma once

#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// Farthest-point sampling (Gonzalez 1985): the first candidate, then again and again the candidate
// that is farthest from those taken; of equal ones the first. At most `count` of them, in that
// order. candidates: indices into points.
std::vector<int> FarthestPoints(std::span<const Vec3> points, std::span<const int> candidates,
                                int count);

}  // namespace semblance
