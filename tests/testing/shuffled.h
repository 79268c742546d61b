// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh in no order.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "surfaces/base/random.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::testing {

// Vertices and triangles in an order that has nothing to do with where they lie.
inline TriMesh Shuffled(const TriMesh& mesh) {
  Random random(3);
  std::vector<std::int32_t> number(mesh.points.size());
  std::iota(number.begin(), number.end(), 0);
  for (std::size_t k = number.size(); k-- > 1;) {
    std::swap(number[k], number[random.Index(k + 1)]);
  }
  TriMesh shuffled = mesh;
  for (std::size_t v = 0; v < number.size(); ++v) {
    shuffled.points[number[v]] = mesh.points[v];
  }
  for (Triangle& t : shuffled.triangles) {
    t = {number[t[0]], number[t[1]], number[t[2]]};
  }
  std::ranges::sort(shuffled.triangles);
  return shuffled;
}

}  // namespace semblance::testing
