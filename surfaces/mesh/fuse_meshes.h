// SPDX-License-Identifier: GPL-3.0-or-later
// Fuses a modelled or scanned feature, such as a nose or an ear, with a mesh (thesis 3.4).
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

struct FusedMesh {
  TriMesh mesh;
  double seam_mm = kNaN;      // length of the curves along which the two meshes meet
  double covered_mm2 = kNaN;  // area of the body that the feature covers
  double added_mm2 = kNaN;    // area of the feature outside the body
};

// Cuts both meshes along the curves where they meet, and keeps of each what lies outside the other.
// Two closed meshes give the surface of their union. Both may also be open: a face that ends at the
// neck, a scanned nose without a back. Then the border of the feature must lie inside the body, and
// the border of the body outside the feature. On which side a part lies is decided at the seam, by
// the angles of the triangles around it, so no closed surface is needed.
//
// Triangles are counter-clockwise seen from outside. No point moves; the seam is a crease. Throws
// InputError, with the place where there is one, if a mesh is not a consistently oriented manifold;
// if a mesh meets itself near the other one, or lies on it; if the meshes do not meet, or a seam
// ends at a border; if a piece of the feature stays apart; and if the feature covers more than half
// of the body, as an inside-out one does.
FusedMesh FuseMeshes(const TriMesh& body, const TriMesh& feature);

}  // namespace semblance::surfaces
