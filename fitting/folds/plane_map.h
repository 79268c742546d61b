// SPDX-License-Identifier: GPL-3.0-or-later
// A map of scattered points to the plane.
#pragma once

#include <cmath>
#include <span>

#include "surfaces/base/geometry.h"

namespace semblance {

// Both in mm, so that lengths can be compared.
struct PlaneMap {
  std::span<const Vec3> positions;
  std::span<const Vec2> at;       // one per position
  Vec2 period_mm = Vec2::Zero();  // along each coordinate; 0: the map does not go round
};

// The shorter way round.
inline Vec2 Way(const Vec2& from, const Vec2& to, const Vec2& period_mm) {
  Vec2 way = to - from;
  for (const int c : {0, 1}) {
    if (period_mm[c] > 0) {
      way[c] -= period_mm[c] * std::round(way[c] / period_mm[c]);
    }
  }
  return way;
}

}  // namespace semblance
