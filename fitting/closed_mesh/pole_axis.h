// SPDX-License-Identifier: GPL-3.0-or-later
// Where the poles of a mesh on the sphere are best put.
#pragma once

#include <span>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Of some hundred directions, both ways, that about whose worse end the map is least distorted, by
// the symmetric Dirichlet energy within 15 degrees. A fit is worst at a pole that lies where
// lengths are stretched.
//   at: per point of the mesh; unit.
Vec3 LeastDistortedAxis(const TriMesh& mesh, std::span<const Vec3> at);

}  // namespace semblance
