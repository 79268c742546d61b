// SPDX-License-Identifier: GPL-3.0-or-later
// Points that take no part in a fit: those without a place, and strays.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "problems/points/point_fit.h"
#include "problems/points/point_table.h"

namespace semblance::problems {

// The points that take no part in the fit.
struct PointsOut {
  std::vector<char> left_out;         // per given point
  std::vector<std::uint32_t> strays;  // ascending
  std::size_t not_finite = 0;
  std::vector<std::uint32_t> given =
      {};  // given indices of the points that take part, if not all do

  bool Any() const { return not_finite + strays.size() > 0; }
};

// Takes the points without finite coordinates out of the table, and strays if (u,v) are not given
// and no point is exact. Throws InputError for an exact point that is not finite.
PointsOut LeaveOut(PointTable& table, bool uv_given);

// Keeps the values of the points that take part.
template <class Value>
void Keep(std::span<const char> left_out, std::vector<Value>& values) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (left_out[k] == 0) {
      values[kept++] = values[k];
    }
  }
  values.resize(kept);
}

// Brings the result to the order and the numbers of the given points.
void RestoreOrder(const PointsOut& out, PointFit& result);

}  // namespace semblance::problems
