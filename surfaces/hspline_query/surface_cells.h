// SPDX-License-Identifier: GPL-3.0-or-later
// The domain of a surface as a quadtree of cells, as deep as the surface's bends ask for.
#pragma once

#include <array>
#include <set>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// As a patch, but of any level: deeper than the surface's finest one too.
using DomainCell = PatchId;

inline constexpr int kDeepestCell = 16;    // level of the smallest cells
inline constexpr double kMostCells = 1e7;  // of one surface

// The quarters of a cell.
std::array<DomainCell, 4> ChildrenOf(const DomainCell& cell);

// How far a triangle with its corners on the surface, within a cell, can be from the surface's
// point of the same (u,v), in mm: an eighth of h_u^2 |S_uu| + 2 h_u h_v |S_uv| + h_v^2 |S_vv|, each
// the largest in the cell (Filip et al. 1986), bounded by second differences of the vertices.
double ChordBound(const HSplineSurface& surface, const DomainCell& cell);

// How many cells keep the chord (> 0): a lower bound of those that are triangulated, as neighbours
// may have to be split too. Infinite where cells would be smaller than a double can tell.
double CellsToChord(const HSplineSurface& surface, double chord_mm);

// The largest cells that cover the domain, each within a patch and with a chord bound of at most
// chord_mm. Throws InputError for a chord that is not positive and finite, or that needs more than
// kMostCells; these are counted before any is made.
std::set<DomainCell> CellsWithinChord(const HSplineSurface& surface, double chord_mm);

// Splits cells that cover the domain until neighbours differ by one level at most, across the seam
// of a closed surface too.
void BalanceCells(const HSplineShape& shape, std::set<DomainCell>& cells);

}  // namespace semblance
