// SPDX-License-Identifier: GPL-3.0-or-later
// A coarse stand-in for a fine mesh that need not be manifold, where its topology does not matter.
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The vertices in one cell of a grid that face the same side (the largest part of their normal)
// become one, at their mean, so that the two sides of a thin wall stay apart; triangles that lose a
// corner are dropped (Rossignac & Borrel 1993). No point moves further than sqrt(3) cells. Same
// input, same bytes. Throws InputError if cell_mm is not positive or a point is not finite.
TriMesh ClusterVertices(const TriMesh& mesh, double cell_mm);

}  // namespace semblance
