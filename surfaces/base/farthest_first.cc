// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/farthest_first.h"

#include <algorithm>
#include <limits>

namespace semblance {

std::vector<std::size_t> FarthestFirst(std::span<const Vec3> points, std::size_t first,
                                       std::size_t count) {
  constexpr double kTaken = -1;
  std::vector<double> distance(points.size(), std::numeric_limits<double>::infinity());
  std::vector<std::size_t> order;
  for (std::size_t next = first; order.size() < std::min(count, points.size());) {
    order.push_back(next);
    distance[next] = kTaken;
    for (std::size_t k = 0; k < points.size(); ++k) {
      distance[k] = std::min(distance[k], (points[k] - points[next]).norm());
    }
    next = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
  }
  return order;
}

}  // namespace semblance
