// SPDX-License-Identifier: GPL-3.0-or-later
// The uniform cubic B-spline along one direction: its four weights on a patch, their derivatives,
// and the dyadic refinement rule.
#pragma once

#include <array>

#include "surfaces/base/geometry.h"

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

// The vertices of the coarser level, along one direction, that make one vertex of the finer level:
// knot insertion at every midpoint. Index may appear twice, then with weight 0.
struct RefinementRow {
  std::array<int, 3> index;
  std::array<double, 3> weight;  // sum 1
};

// Vertex i lies on knot i - 1 of its level. The finer vertex i is made of three coarser ones with
// 1/8 6/8 1/8 where it lies on one (i odd), else of its two neighbours with 1/2 each. i >= 0.
constexpr RefinementRow RefineRow(int i) {
  if (i % 2 != 0) {
    const int c = (i + 1) / 2;
    return {{c - 1, c, c + 1}, {0.125, 0.75, 0.125}};
  }
  return {{i / 2, i / 2 + 1, i / 2}, {0.5, 0.5, 0}};
}

// The vertex that two rows make together; coarse(a, b): that at (u.index[a], v.index[b]). One order
// of sums, so that a vertex has the same bytes however it was come by.
template <class Coarse>
Vec3 RefinedVertex(const RefinementRow& u, const RefinementRow& v, const Coarse& coarse) {
  Vec3 sum = Vec3::Zero();
  for (int b = 0; b < 3; ++b) {
    for (int a = 0; a < 3; ++a) {
      sum += u.weight[a] * v.weight[b] * coarse(a, b);
    }
  }
  return sum;
}

}  // namespace semblance
