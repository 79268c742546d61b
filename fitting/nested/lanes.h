// SPDX-License-Identifier: GPL-3.0-or-later
// What the loops over points share: eight numbers in one register, and a point's weights.
#pragma once

#include <cstring>

#include "surfaces/base/simd.h"

namespace semblance {

// It is always inlined: no call depends on how the vector would be returned.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"
SEMBLANCE_INLINE Wider EightAt(const double* from) {
  Wider n;
  std::memcpy(&n, from, sizeof n);
  return n;
}
#pragma GCC diagnostic pop
SEMBLANCE_INLINE void PutEight(const Wider& n, double* to) { std::memcpy(to, &n, sizeof n); }

// In one order, so that every processor gives the same bits.
SEMBLANCE_INLINE double SumOfEight(const Wider& n) {
  return ((n[0] + n[4]) + (n[2] + n[6])) + ((n[1] + n[5]) + (n[3] + n[7]));
}

// CubicWeights, in the instructions of whichever clone calls it.
SEMBLANCE_INLINE void WeightsAt(double t, double* weights) {
  const double s = 1 - t;
  weights[0] = s * s * s / 6;
  weights[1] = (4 - 6 * t * t + 3 * t * t * t) / 6;
  weights[2] = (4 - 6 * s * s + 3 * s * s * s) / 6;
  weights[3] = t * t * t / 6;
}

}  // namespace semblance
