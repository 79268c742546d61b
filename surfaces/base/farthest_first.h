// SPDX-License-Identifier: GPL-3.0-or-later
// Chooses a few points that lie far apart.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::surfaces {

// Treatment of points that coincide with chosen ones: chosen last, or never.
enum class Coincident { kTaken, kLeftOut };

// Returns the indices of `count` points, or of all if there are fewer. It begins with `first`, and
// then adds the point farthest from all chosen ones (Gonzalez 1985); on a tie, the lowest index. No
// index is repeated. Takes time count * points.size().
std::vector<std::size_t> FarthestFirst(std::span<const Vec3> points, std::size_t first,
                                       std::size_t count,
                                       Coincident coincident = Coincident::kTaken);

}  // namespace semblance::surfaces
