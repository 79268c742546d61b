// SPDX-License-Identifier: GPL-3.0-or-later
// A closed surface that is star-shaped about the origin and smooth at its poles.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "surfaces/base/random.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::testing {

// distance of the surface from the origin
using RadiusAlong = std::function<double(const Vec3& unit)>;

inline double BallRadius(const Vec3&) { return 1; }
inline double StoneRadius(const Vec3& d) {
  return 1 + 0.15 * std::sin(3 * d.x() + 1) * std::cos(2 * d.y()) +
         0.1 * std::sin(4 * d.z() + 2 * d.x() - d.y());
}

// Points in uniformly distributed directions.
inline std::vector<Vec3> PointsAround(const RadiusAlong& radius, int count, double noise) {
  Random random(3);
  std::vector<Vec3> positions;
  for (int k = 0; k < count; ++k) {
    const Vec3 d = Vec3(random.Normal(), random.Normal(), random.Normal()).normalized(),
               off(random.Normal(), random.Normal(), random.Normal());
    positions.push_back(radius(d) * d + noise * off);
  }
  return positions;
}

// Largest and RMS distance along rays from the origin, for rings from v = first to last.
struct RingErrors {
  double rms = 0, largest = 0;
};
inline RingErrors ErrorsOfRings(const HSplineSurface& surface, const RadiusAlong& radius,
                                double first, double last) {
  constexpr int kRings = 40, kAround = 60;
  double squares = 0, weights = 0;
  RingErrors errors;
  for (int j = 0; j < kRings; ++j) {
    const double v = first + (last - first) * (j + 0.5) / kRings;
    for (int i = 0; i < kAround; ++i) {
      const Vec3 p = surface.Point(Vec2((i + 0.5) / kAround, v));
      const double off = std::abs(p.norm() - radius(p.normalized()));
      squares += std::sin(std::numbers::pi * v) * off * off;
      weights += std::sin(std::numbers::pi * v);
      errors.largest = std::max(errors.largest, off);
    }
  }
  errors.rms = std::sqrt(squares / weights);
  return errors;
}

}  // namespace semblance::testing
