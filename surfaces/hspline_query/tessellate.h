// SPDX-License-Identifier: GPL-3.0-or-later
// An H-spline surface as a triangle mesh for people and for measuring.
#pragma once

#include <vector>

#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct Tessellation {
  TriMesh mesh;               // triangles counter-clockwise seen from the side of du x dv
  std::vector<Vec2> uv;       // per vertex
  std::vector<Vec3> normals;  // per vertex: unit, of the surface itself
};

// Uniform: `per_patch` (>= 1) quads along each side of each patch of the finest level, two
// triangles each; vertices on a seam are shared.
Tessellation Tessellate(const HSplineSurface& surface, int per_patch);

}  // namespace semblance
