// SPDX-License-Identifier: GPL-3.0-or-later
// How much a mesh encloses.
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// mm^3; > 0 if closed and outward; of an open mesh it depends on the origin.
inline double SignedVolume(const TriMesh& mesh) {
  double six_volumes = 0;
  for (const Triangle& t : mesh.triangles) {
    six_volumes += mesh.points[t[0]].dot(mesh.points[t[1]].cross(mesh.points[t[2]]));
  }
  return six_volumes / 6;
}

}  // namespace semblance
