// SPDX-License-Identifier: GPL-3.0-or-later
// A deep-drawn sheet part, scanned optically with gaps.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "fitting/problem/fit_target.h"
#include "tests/testing/scattered_data.h"

namespace semblance::testing {
using namespace problems;

inline constexpr double kDrawnDepth = 0.15;

// The profile from a floor at height 0 through a radius into a wall of 75 degrees. x is measured
// from the intersection of floor and wall.
inline double FloorToWall(double x) {
  constexpr double kRadius = 0.02, kWall = 75 * std::numbers::pi / 180;
  const double tangent = kRadius * std::tan(kWall / 2);
  if (x < -tangent) {
    return 0;
  }
  const double along = x + tangent;
  return x < tangent * std::cos(kWall) ? kRadius - std::sqrt(kRadius * kRadius - along * along)
                                       : x * std::tan(kWall);
}

// Signed distance from the unit square's inner rectangle of 0.6 x 0.44 with corners of radius 0.08.
inline double DrawnOutline(const Vec2& uv) {
  const Vec2 q = (uv - Vec2(0.5, 0.5)).cwiseAbs() - Vec2(0.22, 0.14);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0) - 0.08;
}

// A flat flange at height 0, a wall, and a floor at -kDrawnDepth, both joined to it by radii.
inline Vec3 DrawnPoint(const Vec2& uv) {
  const double across = DrawnOutline(uv);
  const double half = kDrawnDepth / 2 / std::tan(75 * std::numbers::pi / 180);
  const double z =
      across < 0 ? FloorToWall(across + half) - kDrawnDepth : -FloorToWall(half - across);
  return {uv.x(), uv.y(), z};
}

struct DrawnGap {
  Vec2 center;
  double radius;
};
// Gaps in the floor, across the wall, in a corner of the wall, on the flange, and at the part's
// corner.
inline const std::array<DrawnGap, 5> kDrawnGaps = {{{{0.42, 0.5}, 0.08},
                                                    {{0.8, 0.5}, 0.06},
                                                    {{0.25, 0.33}, 0.05},
                                                    {{0.5, 0.14}, 0.06},
                                                    {{1, 1}, 0.15}}};

inline bool InDrawnGap(const Vec2& uv) {
  return std::any_of(kDrawnGaps.begin(), kDrawnGaps.end(),
                     [&](const DrawnGap& g) { return (uv - g.center).norm() < g.radius; });
}

// A scan of `count` points at random (u,v) without the gaps, with noise in each coordinate.
inline FitTarget DrawnScan(int count, double noise, std::uint64_t random_seed) {
  FitTarget target = Scattered(DrawnPoint, count, noise, random_seed);
  std::erase_if(target.points, [](const FitPoint& p) { return InDrawnGap(p.uv); });
  return target;
}

}  // namespace semblance::testing
