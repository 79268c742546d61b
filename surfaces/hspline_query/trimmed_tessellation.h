// SPDX-License-Identifier: GPL-3.0-or-later
// A surface as triangles, without what is far from some points.
#pragma once

#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

struct TrimmedTessellation {
  Tessellation kept;
  double kept_mm2 = kNaN;  // area of the triangles that are left
  double cut_mm2 = kNaN;   // of those that are not
};

// The part of a surface that is at most distance_mm from the nearest of some points, as triangles
// within chord_mm of it. Where a border is, cells are split until they are small against the
// distance (an eighth of it) and their triangles are cut where the distance is reached, by
// bisection along their edges: no vertex is farther, and what lies deeper inside than a fourth of
// the distance is there. Pieces stay apart; none is dropped.
//   near: points on the surface, or close to it.
//   distance_mm: > 0 and finite.
// No byte depends on `threads` (>= 1). Throws InputError as TessellateToChord does, for a distance
// out of range, and for one that needs more than a few million cells or leaves nothing.
TrimmedTessellation TessellateNear(const HSplineSurface& surface, double chord_mm,
                                   const PointQuery& near, double distance_mm, int threads = 1);

}  // namespace semblance
