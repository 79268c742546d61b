// SPDX-License-Identifier: GPL-3.0-or-later
// Helpers of the vectorised loops: eight numbers in one register, and the B-spline weights of a
// point.
#pragma once

#include <cstring>

#include "surfaces/base/simd.h"

namespace semblance::fitting {

// The function is always inlined, so the warning about returning a vector does not apply.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"
SEMBLANCE_INLINE Wider EightAt(const double* from) {
  Wider n;
  std::memcpy(&n, from, sizeof n);
  return n;
}
#pragma GCC diagnostic pop
SEMBLANCE_INLINE void PutEight(const Wider& n, double* to) { std::memcpy(to, &n, sizeof n); }

// Sums in a fixed order, so that every processor gives the same bits.
SEMBLANCE_INLINE double SumOfEight(const Wider& n) {
  return ((n[0] + n[4]) + (n[2] + n[6])) + ((n[1] + n[5]) + (n[3] + n[7]));
}

// Computes CubicWeights bit by bit, in the instruction set of the calling clone. Each of the four
// weights is a cubic of t or 1 - t, so one division serves all.
SEMBLANCE_INLINE void WeightsAt(double t, double* weights) {
  constexpr Wide kOnes = {0, 4, 4, 0}, kSquares = {0, 6, 6, 0}, kCubes = {1, 3, 3, 1};
  const double s = 1 - t;
  const Wide x = {s, t, s, t};
  const Wide cubics = (kOnes - kSquares * x * x + kCubes * x * x * x) / 6;
  std::memcpy(weights, &cubics, sizeof cubics);
}

}  // namespace semblance::fitting
