// SPDX-License-Identifier: GPL-3.0-or-later
// Fewer triangles, the same shape; even triangles, the same shape.
#pragma once

#include "surfaces/tri_mesh.h"

namespace semblance {

// Edge collapses by quadric error (Garland & Heckbert 1997; thesis 3.3) until at most
// target_triangles are left, or none can be collapsed without turning a triangle by more than a
// right angle. Manifold in, manifold out; open borders stay. Throws InputError if the mesh is not a
// consistently oriented manifold.
TriMesh Decimate(const TriMesh& mesh, int target_triangles);

// Triangles with edges near edge_mm (> 0) on the same surface (Botsch & Kobbelt 2004). Manifold in,
// manifold out. Throws as Decimate does.
TriMesh Remesh(const TriMesh& mesh, double edge_mm);

}  // namespace semblance
