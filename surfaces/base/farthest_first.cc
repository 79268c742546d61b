// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/farthest_first.h"

#include <algorithm>
#include <limits>

namespace semblance::surfaces {

std::vector<std::size_t> FarthestFirst(std::span<const Vec3> points, std::size_t first,
                                       std::size_t count, Coincident coincident) {
  constexpr double kTaken = -1;
  const double least = coincident == Coincident::kTaken ? 0 : std::numeric_limits<double>::min();
  std::vector<double> squared(points.size(), std::numeric_limits<double>::infinity());
  std::vector<std::size_t> order;
  for (std::size_t next = first;
       order.size() < std::min(count, points.size()) && squared[next] >= least;) {
    order.push_back(next);
    squared[next] = kTaken;
    for (std::size_t k = 0; k < points.size(); ++k) {
      squared[k] = std::min(squared[k], (points[k] - points[next]).squaredNorm());
    }
    next = static_cast<std::size_t>(std::ranges::max_element(squared) - squared.begin());
  }
  return order;
}

}  // namespace semblance::surfaces
