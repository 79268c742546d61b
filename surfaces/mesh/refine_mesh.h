// SPDX-License-Identifier: GPL-3.0-or-later
// Finer triangles for the same surface.
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// The mean edge that is fine enough for sums over the vertices of a head. On edges of 5 mm such a
// sum moves a face, or a distance between faces, by 0.02 mm (RMS); finer ones cost time.
inline constexpr double kEdgeForSums_mm = 3;

// The same surface with each triangle in four, by the middles of its edges, until the mean length
// of the edges is at most mean_edge_mm > 0, or until the mesh has more than a quarter of a million
// triangles. Sums over vertices depend on the size of triangles; two meshes of which one refines
// the other become equal, up to the order of their points, unless the coarser one is fine enough.
// Unlike the subdivisions of CGAL and OpenMesh it takes any mesh, also one that is no manifold.
// Points keep their indices; new ones follow.
TriMesh RefineTo(TriMesh mesh, double mean_edge_mm);

}  // namespace semblance::surfaces
