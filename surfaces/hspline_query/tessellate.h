// SPDX-License-Identifier: GPL-3.0-or-later
// Triangulates an H-spline surface: uniformly, or with few triangles within a chord error. Also
// closes the poles of a tube.
#pragma once

#include <array>
#include <set>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

struct Tessellation {
  TriMesh mesh;               // counter-clockwise, seen from the side of du x dv
  std::vector<Vec2> uv;       // per vertex
  std::vector<Vec3> normals;  // per vertex: the surface's unit normal
};

// Makes a uniform grid: `per_patch` (>= 1) quads along each side of each patch of the finest level,
// and two triangles per quad. Both sides of a seam share their vertices.
Tessellation Tessellate(const HSplineSurface& surface, int per_patch);

// Each point of a triangle lies within chord_mm (> 0) of the surface's point of the same (u,v). A
// bound of the second derivatives guarantees this (Filip et al. 1986). The triangles cover a
// quadtree of the domain whose neighbouring cells differ by at most one level and share all their
// vertices. Hence the mesh is watertight, also across seams. Vertices lie on the surface; normals
// are zero where the surface has none. The result does not depend on `threads` (>= 1). Throws
// InputError for a chord that is not positive and finite, or that needs more than ten million
// cells. The cells are counted before any is created.
Tessellation TessellateToChord(const HSplineSurface& surface, double chord_mm, int threads = 1);

// A cell is like a patch, but its level may exceed the surface's finest level.
using DomainCell = PatchId;

inline constexpr int kDeepestCell = 16;   // level of the smallest cells
inline constexpr double kMaxCells = 1e7;  // per surface; bounds memory

// The four quarters of a cell.
std::array<DomainCell, 4> Children(const DomainCell& cell);

// Bounds the distance, in mm, between a triangle within a cell, with its corners on the surface,
// and the surface's point of the same (u,v): (h_u^2 |S_uu| + 2 h_u h_v |S_uv| + h_v^2 |S_vv|) / 8,
// where each norm is the largest in the cell (Filip et al. 1986) and is bounded by second
// differences of the control vertices.
double ChordBound(const HSplineSurface& surface, const DomainCell& cell);

// The number of cells within the chord error chord_mm (> 0), before balancing, which may split
// more. Infinite if cells beyond kDeepestCell would be needed.
double CellsToChord(const HSplineSurface& surface, double chord_mm);

// Covers the domain with the largest cells that lie within a patch and whose ChordBound is at most
// chord_mm. Throws InputError for a chord that is not positive and finite, or that needs more than
// kMaxCells. The cells are counted before any is created.
std::set<DomainCell> CellsWithinChord(const HSplineSurface& surface, double chord_mm);

// Splits cells that cover the domain until neighbours differ by at most one level, also across
// seams.
void BalanceCells(const HSplineShape& shape, std::set<DomainCell>& cells);

}  // namespace semblance::surfaces
