// SPDX-License-Identifier: GPL-3.0-or-later
// The uniform bicubic B-spline surface: its basis functions and their refinement, its control net,
// and its points as weighted sums of control vertices.
#pragma once

#include <array>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::surfaces {

// The weights of the four control values that act on a span of unit length, at t in [0,1]:
// (1-t)^3/6, (4 - 6 t^2 + 3 t^3)/6, (1 + 3 t + 3 t^2 - 3 t^3)/6, t^3/6. `order` 1 or 2 gives their
// first or second derivatives. The weights of order 0 sum to 1, the others to 0.
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

// One finer control value as a weighted sum of up to three coarser ones, after a knot was inserted
// at the midpoint of each span. An index may appear twice, once with weight 0.
struct RefinementRow {
  std::array<int, 3> index;
  std::array<double, 3> weight;  // sum 1
};

// Vertex i >= 0 belongs to knot i - 1 of its level. A finer vertex at a coarser knot (i odd) has
// the weights 1/8, 6/8, 1/8. A finer vertex between two coarser knots (i even) is their mean.
constexpr RefinementRow RefineRow(int i) {
  if (i % 2 != 0) {
    const int c = (i + 1) / 2;
    return {{c - 1, c, c + 1}, {0.125, 0.75, 0.125}};
  }
  return {{i / 2, i / 2 + 1, i / 2}, {0.5, 0.5, 0}};
}

// The tensor product of two rows: sum over a, b of u.weight[a] v.weight[b] coarse(a, b), where
// coarse(a, b) is the vertex at (u.index[a], v.index[b]). All callers use this order of sums, so
// that a vertex has the same bytes on every path.
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

// The absolute control vertices of one level, in columns along u and rows along v. A domain of m x
// n patches has m + 3 columns if u is open and m if u is closed; it has n + 3 or n rows.
struct ControlNet {
  int columns = 0;
  int rows = 0;
  std::vector<Vec3> vertices;  // rows * columns, mm; vertex (i, j) at i + columns * j

  int Index(int i, int j) const { return i + columns * j; }
  const Vec3& At(int i, int j) const { return vertices[Index(i, j)]; }
  Vec3& At(int i, int j) { return vertices[Index(i, j)]; }
};

// A point of a level's B-spline, or a derivative, as a linear function of the net: S(u,v) = sum_k
// weight[k] * net.vertices[index[k]]. Along a closed direction with few vertices an index may
// appear twice.
struct Stencil {
  std::array<int, 16> index{};
  std::array<double, 16> weight{};  // sum 1 for a point, 0 for a derivative

  Vec3 Apply(const ControlNet& net) const {
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < 16; ++k) {
      sum += weight[k] * net.vertices[index[k]];
    }
    return sum;
  }
};

}  // namespace semblance::surfaces
