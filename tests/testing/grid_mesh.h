// SPDX-License-Identifier: GPL-3.0-or-later
// A surface over the unit square as triangles.
#pragma once

#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::testing {

// n x n cells of two triangles, which look along du x dv.
template <class Surface>
TriMesh GridMesh(const Surface& surface, int n) {
  TriMesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      mesh.points.push_back(surface(Vec2(static_cast<double>(i) / n, static_cast<double>(j) / n)));
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = i + (n + 1) * j, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  return mesh;
}

}  // namespace semblance::testing
