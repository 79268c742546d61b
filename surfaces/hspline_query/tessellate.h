// SPDX-License-Identifier: GPL-3.0-or-later
// Triangulates an H-spline surface, and closes its poles.
#pragma once

#include <array>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct Tessellation {
  TriMesh mesh;               // counter-clockwise, seen from the side of du x dv
  std::vector<Vec2> uv;       // per vertex
  std::vector<Vec3> normals;  // per vertex: the surface's unit normal
};

// Makes a uniform grid: `per_patch` (>= 1) quads along each side of each patch of the finest level,
// and two triangles per quad. Both sides of a seam share their vertices.
Tessellation Tessellate(const HSplineSurface& surface, int per_patch);

// Joins the vertices of the edge v = 0 or v = 1 into one vertex at `place`, for a surface whose
// edge is (nearly) one point. The vertex gets the mean normal of its triangles, and triangles
// without area are removed. This closes the hole and replaces normals that noise has turned.
//     v: 0 or 1. Without a vertex on that edge nothing changes.
void JoinEdge(Tessellation& tessellation, double v, const Vec3& place);

// The opening at a pole of a surface that is closed in u: the edge v = 0 or v = 1 of the domain,
// which should be one point.
struct PoleGap {
  Vec3 place = Vec3::Constant(kNaN);  // mean point of the edge, mm
  double gap_mm = kNaN;               // largest distance of the edge from `place`
};
using PoleGaps = std::array<PoleGap, 2>;  // at v = 0 and v = 1
PoleGaps PoleGapsOf(const HSplineSurface& surface);

// Returns true if the surface is closed in u only, and both its edges are narrower than a twentieth
// of the widest of the rings v = 1/4, 1/2, 3/4. Points on a closed cylinder give wider edges; so
// may noisy points on a sphere.
bool ClosesAtPoles(const HSplineSurface& surface, const PoleGaps& gaps);

// Joins both edges into one vertex each (JoinEdge), which makes the mesh watertight.
void JoinPoles(const PoleGaps& gaps, Tessellation& tessellation);

}  // namespace semblance
