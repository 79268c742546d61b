// SPDX-License-Identifier: GPL-3.0-or-later
// The side of a mesh that faces the open: without the walls of cavities.
#pragma once

#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Per triangle: whether a straight line leaves the mesh from its centre without meeting another
// triangle, along its normal or along one of eight directions 60 degrees from it. So the skin is
// seen, also in folds that are as wide as deep; walls of sinuses, airways and of an inner layer are
// not, whether the mesh is closed or not. Triangles must be counter-clockwise seen from outside.
// threads >= 1; the result does not depend on it. Throws InputError as MeshQuery does.
std::vector<bool> SeenFromOutside(const TriMesh& mesh, int threads);

}  // namespace semblance
