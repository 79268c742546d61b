// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles over cells of a surface's domain.
#pragma once

#include <set>

#include "surfaces/hspline_query/surface_cells.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance {

// Two triangles per cell, or a fan of up to eight where a neighbour is finer: cells share all their
// vertices, across the seam of a closed surface too. cells: they cover the domain; those that are
// coarser than a neighbour by more than one level are split first. Vertices lie on the surface;
// normals are zero where it has none. No byte depends on `threads` (>= 1).
Tessellation TessellateCells(const HSplineSurface& surface, std::set<DomainCell> cells,
                             int threads);

}  // namespace semblance
