// SPDX-License-Identifier: GPL-3.0-or-later
// A closed mesh laid out on the sphere.
#pragma once

#include <span>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct ClosedLayout {
  std::vector<Vec3> at;              // per point; unit
  Vec3 axis = Vec3::Constant(kNaN);  // through the poles; unit
  // Shares of the mesh's area: of triangles that are turned over, and of those of which a fortieth
  // is left or less, where a map without distortion keeps all.
  double folded = kNaN, collapsed = kNaN;
};

// One to one, and as little distorted as it can be (sphere_relaxer.h). The mesh is taken apart to a
// tetrahedron; its vertices are put back one by one where no triangle is turned, and relaxed each
// time that there are a third more (Praun & Hoppe 2003). The poles lie where it is least distorted.
// By one thread; of points that differ, the order makes no difference, nor does that of triangles.
//   mesh: one piece, closed, manifold, without handles, every point used.
// Throws InputError for any other mesh, with what it has instead and what to do.
ClosedLayout LayOutOnSphere(const TriMesh& mesh);

// Whether it has triangles and none of their edges is a border.
bool IsClosed(std::span<const Triangle> triangles);

}  // namespace semblance
