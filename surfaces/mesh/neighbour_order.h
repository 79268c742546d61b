// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes whose vertices stand in memory as they do on the surface.
#pragma once

#include <cstdint>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Whether neighbours are far apart in memory, so that work along the surface would wait for it: in
// a surface that is stored row by row a row lies between them.
bool IsScattered(const TriMesh& mesh);

// A mesh with its vertices and triangles in another order, and the indices that they had.
struct OrderedMesh {
  TriMesh mesh;
  std::vector<std::int32_t> vertices, triangles;
};

// Breadth first over the surface: an order that does not depend on how the mesh lies in space.
OrderedMesh InOrderOfNeighbours(const TriMesh& mesh);

// Gives a part of `ordered` the order of the mesh that it was made of. part: all points, moved or
// not, and some triangles, whose corners may be others; triangles: their indices in `ordered`.
void PutBackInOrder(const OrderedMesh& ordered, const std::vector<std::int32_t>& triangles,
                    TriMesh& part);

}  // namespace semblance
