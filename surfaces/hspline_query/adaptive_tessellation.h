// SPDX-License-Identifier: GPL-3.0-or-later
// Triangulates an H-spline surface with few triangles within a chord error.
#pragma once

#include "surfaces/hspline_query/tessellate.h"

namespace semblance {

// Each point of a triangle lies within chord_mm (> 0) of the surface's point of the same (u,v). A
// bound of the second derivatives guarantees this (Filip et al. 1986). The triangles cover a
// quadtree of the domain whose neighbouring cells differ by at most one level and share all their
// vertices. Hence the mesh is watertight, also across seams. Vertices lie on the surface; normals
// are zero where the surface has none. The result does not depend on `threads` (>= 1). Throws
// InputError for a chord that is not positive and finite, or that needs more than ten million
// cells. The cells are counted before any is created.
Tessellation TessellateToChord(const HSplineSurface& surface, double chord_mm, int threads = 1);

}  // namespace semblance
