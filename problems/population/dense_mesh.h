// SPDX-License-Identifier: GPL-3.0-or-later
// The grid of dense depths as a mesh, to be looked at.
#pragma once

#include <cstddef>
#include <vector>

#include "problems/population/depth_modes.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The mean places of the cells that any subject has, in the frame of the average skull.
struct DenseMesh {
  TriMesh mesh;
  std::vector<std::size_t> cells;  // of its vertices
};
DenseMesh MeshOf(const DepthModes& dense);

// A cell's value at each vertex.
std::vector<double> OnVertices(const DenseMesh& mesh, const std::vector<double>& by_cell);

}  // namespace semblance
