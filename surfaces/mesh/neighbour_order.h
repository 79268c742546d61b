// SPDX-License-Identifier: GPL-3.0-or-later
// Reorders a mesh so that neighbours on the surface are near each other in memory.
#pragma once

#include <cstdint>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// True if neighbours are so far apart in memory that work along the surface would wait for it. In a
// surface that is stored row by row, neighbours are at most a row apart.
bool IsScattered(const TriMesh& mesh);

// A reordered mesh, and the former indices of its vertices and triangles.
struct OrderedMesh {
  TriMesh mesh;
  std::vector<std::int32_t> vertices, triangles;
};

// Orders the mesh breadth first over the surface. The order does not depend on the position of the
// mesh in space.
OrderedMesh InOrderOfNeighbours(const TriMesh& mesh);

// Restores the former order of a part of `ordered`.
//   part: all points, moved or not, and some triangles, whose corners may have changed
//   triangles: the indices in `ordered` of the triangles of the part
void PutBackInOrder(const OrderedMesh& ordered, const std::vector<std::int32_t>& triangles,
                    TriMesh& part);

}  // namespace semblance::surfaces
