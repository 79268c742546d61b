// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/adaptive_tessellation.h"

#include "surfaces/hspline_query/cell_triangles.h"
#include "surfaces/hspline_query/surface_cells.h"

namespace semblance {

Tessellation TessellateToChord(const HSplineSurface& surface, double chord_mm, int threads) {
  return TessellateCells(surface, CellsWithinChord(surface, chord_mm), threads);
}

}  // namespace semblance
