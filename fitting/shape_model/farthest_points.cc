// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/shape_model/farthest_points.h"

#include <algorithm>
#include <limits>

namespace semblance {

std::vector<int> FarthestPoints(std::span<const Vec3> points, std::span<const int> candidates,
                                int count) {
  std::vector<int> taken;
  std::vector<double> squared_mm(candidates.size(), std::numeric_limits<double>::infinity());
  while (!candidates.empty() &&
         std::ssize(taken) < std::min<std::ptrdiff_t>(count, std::ssize(candidates))) {
    const auto farthest = std::ranges::max_element(squared_mm);
    const int next = candidates[farthest - squared_mm.begin()];
    if (*farthest == 0) {
      break;  // all others lie on those taken
    }
    taken.push_back(next);
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      squared_mm[k] = std::min(squared_mm[k], (points[candidates[k]] - points[next]).squaredNorm());
    }
  }
  return taken;
}

}  // namespace semblance
