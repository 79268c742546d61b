// SPDX-License-Identifier: GPL-3.0-or-later
// A few of many points that lie far apart.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// Whether points that lie on others are taken at the end or never.
enum class Coincident { kTaken, kLeftOut };

// Indices of `count` points (of all, if there are no more): `first`, then always the one that is
// farthest from those before it (Gonzalez 1985); of equally far ones the first. Each index stands
// there once. Costs count times the number of points.
std::vector<std::size_t> FarthestFirst(std::span<const Vec3> points, std::size_t first,
                                       std::size_t count,
                                       Coincident coincident = Coincident::kTaken);

}  // namespace semblance
