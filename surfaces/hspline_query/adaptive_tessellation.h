// SPDX-License-Identifier: GPL-3.0-or-later
// An H-spline surface as few triangles that keep a chord error.
#pragma once

#include "surfaces/hspline_query/tessellate.h"

namespace semblance {

// No point of a triangle is further than chord_mm (> 0) from the surface's point of the same (u,v):
// guaranteed, by a bound of the second derivatives (Filip et al. 1986). A quadtree of the domain,
// whose neighbours differ by one level at most and share all their vertices: watertight, also
// across seams. Vertices lie on the surface; normals are zero where the surface has none. No
// byte depends on `threads` (>= 1). Throws InputError for a chord that is not positive and finite,
// or so small that more than ten million cells would be needed; these are counted before any is
// made.
Tessellation TessellateToChord(const HSplineSurface& surface, double chord_mm, int threads = 1);

}  // namespace semblance
