// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes thinned out for the eye.
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Of a report's meshes.
inline constexpr int kViewTriangles = 24000;

// At most about so many triangles, whatever the mesh is like.
TriMesh ForView(const TriMesh& mesh, int most_triangles = kViewTriangles);

}  // namespace semblance
