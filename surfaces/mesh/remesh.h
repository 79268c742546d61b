// SPDX-License-Identifier: GPL-3.0-or-later
// Even triangles, the same shape.
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Triangles with edges near edge_mm (> 0) on the same surface (Botsch & Kobbelt 2004). Manifold in,
// manifold out. Throws InputError if the mesh is not a consistently oriented manifold.
TriMesh Remesh(const TriMesh& mesh, double edge_mm);

}  // namespace semblance
