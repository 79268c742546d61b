// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/best_first.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace semblance {

std::vector<std::size_t> BestFirst(std::span<const double> costs) {
  std::vector<std::size_t> order(costs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) {
    return std::isfinite(costs[i]) ? costs[i] : std::numeric_limits<double>::infinity();
  });
  return order;
}

}  // namespace semblance
