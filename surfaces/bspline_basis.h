// SPDX-License-Identifier: GPL-3.0-or-later
// The uniform cubic B-spline: its four weights on a patch and their derivatives.
#pragma once

#include <array>

namespace semblance {

// The four weights, or their derivatives of the given order (0, 1 or 2), at t in [0,1] on a patch
// of unit length. Order 0 sums to 1, the others to 0.
constexpr std::array<double, 4> CubicWeights(double t, int order) {
  const double s = 1 - t;
  switch (order) {
    case 0:
      return {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6,
              (4 - 6 * s * s + 3 * s * s * s) / 6, t * t * t / 6};
    case 1:
      return {-s * s / 2, (3 * t * t - 4 * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2};
    default:
      return {s, 3 * t - 2, 3 * s - 2, t};
  }
}

}  // namespace semblance
