// SPDX-License-Identifier: GPL-3.0-or-later
// Overlays: which vertices of a level exist around its edits, and which of them may be edited
// (Forsey & Bartels 1988; thesis 4.1, definitions 4.1 to 4.3).
#pragma once

#include <set>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Vertices of one level that exist, i.e. that need not follow the coarser level.
using Overlay = std::set<VertexId>;

// Definition 4.1: the 7 x 7 vertices of level coarse.level + 1 centred at the vertex `coarse`,
// which redefine exactly the four patches of coarse.level that meet at it. Clipped at open borders
// of the domain, wrapped along periodic u. Overlays of one level merge by union (definition 4.3).
Overlay LocalRefinement(const HSplineShape& shape, const VertexId& coarse);

// Definition 4.3: whether the 7 x 7 vertices around `vertex`, clipped at open borders, all exist in
// the (composite) overlay.
bool IsEditable(const HSplineShape& shape, const Overlay& overlay, const VertexId& vertex);

// The composite overlay of `level` (1..max_level) that the surface's edits span: the union of the
// local refinements about the coarser vertices at or next to an edited vertex. Every edited vertex
// is editable in it; outside its patches the level is the next coarser surface.
Overlay CompositeOverlay(const HSplineSurface& surface, int level);

}  // namespace semblance
