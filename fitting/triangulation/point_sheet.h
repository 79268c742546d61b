// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles between points that have none, where they make one open sheet.
#pragma once

#include <string>

#include "fitting/triangulation/even_points.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct PointSheet {
  TriMesh mesh;       // one piece with a border, manifold, without handles
  std::string fault;  // why there is none, with figures and what else to do; empty if there is
};

// By an advancing front over the Delaunay tetrahedra (Cohen-Steiner & Da 2004), with edges of a
// few spacings at most. Small pieces beside the largest are left out. The triangles have no side of
// their own: they are turned so that the largest component of their sum of area vectors is
// positive. Deterministic.
PointSheet SheetBetween(const EvenPoints& points);

}  // namespace semblance
