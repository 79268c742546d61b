// SPDX-License-Identifier: GPL-3.0-or-later
// Finds mistakes in heights that only neighbours show: a part of the file with another zero, and
// zeros in place of missing heights.
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

}  // namespace semblance::problems
