// SPDX-License-Identifier: GPL-3.0-or-later
// Finds mistakes that a part of the points shows beside the others: heights with another zero,
// zeros in place of missing heights, points in another unit.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::problems {

// Compares each of at most 1,000 points, spread evenly over the file, with its neighbours among
// them. Returns a sentence for each finding:
//   parts   The points up to one place in the file lie higher or lower than those behind it, over
//           the same ground, and this explains more than half of the differences between
//           neighbours.
//   zeros   Heights are exactly 0, their neighbours are not, and they differ from these far more
//           than other points do.
std::vector<std::string> FindHeightMistakes(std::span<const Vec3> positions,
                                            std::span<const Vec2> uv);

// States that some points lie far nearer to the origin than the others, and among these if they are
// multiplied by a factor between two units (10, 12, 25.4, 100, 1000); empty if there are none.
std::string FindPartInAnotherUnit(std::span<const Vec3> positions);

}  // namespace semblance::problems
