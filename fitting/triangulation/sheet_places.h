// SPDX-License-Identifier: GPL-3.0-or-later
// Where points near a mesh lie on the plane that the mesh is laid out on.
#pragma once

#include <span>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct SheetPlaces {
  std::vector<Vec2> at;             // one per point
  std::vector<double> distance_mm;  // from the mesh
};

// Around each corner of the mesh its layout is a quadratic over the tangent plane, by least squares
// over the corners that two edges reach. A point goes where those of the nearest triangle's corners
// say, weighted as the nearest place in the triangle. So noise of the mesh is less, its edges leave
// no creases, and what lies outside the border goes on from there, but not by more than an edge.
//   mesh: as LayOut takes it; at: of its points; points: finite.
SheetPlaces PlacesOnSheet(const TriMesh& mesh, std::span<const Vec2> at,
                          std::span<const Vec3> points);

}  // namespace semblance
