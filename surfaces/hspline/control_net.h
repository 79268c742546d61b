// SPDX-License-Identifier: GPL-3.0-or-later
// One level of an H-spline seen as a plain B-spline: its control vertices, and a point of it as a
// weighted sum of sixteen of them.
#pragma once

#include <array>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// The absolute control vertices of one level. `columns` run along u, `rows` along v. For a domain
// of m x n patches: columns = m + 3 if u is open, m if it is closed; rows = n + 3 or n, likewise.
struct ControlNet {
  int columns = 0;
  int rows = 0;
  std::vector<Vec3> vertices;  // rows * columns; (i, j) at i + columns * j, i along u; mm;
                               // contiguous, x y z interleaved

  int Index(int i, int j) const { return i + columns * j; }
  const Vec3& At(int i, int j) const { return vertices[Index(i, j)]; }
  Vec3& At(int i, int j) { return vertices[Index(i, j)]; }
};

// S(u,v) = sum_k weight[k] * net.vertices[index[k]], exactly the bicubic B-spline of the level at
// (u,v). Along a closed direction with few vertices an index may appear twice.
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

}  // namespace semblance
