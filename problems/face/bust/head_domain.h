// SPDX-License-Identifier: GPL-3.0-or-later
// A whole head, ears included, over one (u,v), and points of it on a regular grid of that domain.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// The head's mesh with its holes closed, and the (u,v) of its points. u goes round the head, from
// the back (0) over the subject's right side, the face (0.5) and the left side (1 is 0 again). v
// goes from the border of the neck (0) to the crown (1), where all u meet.
struct HeadDomain {
  TriMesh mesh;          // mm, LPS; the points of the head first, in their order
  std::vector<Vec2> uv;  // one per point; u in [0,1), v in [0,1]
  int crown = -1;        // the point with v = 1; its u means nothing
  std::vector<std::vector<std::int32_t>> rims;  // the points round each closed hole
};

// Takes the longest border of the mesh for that of the neck. Closes every other border (the
// openings of the eyes and the mouth) by a pocket that goes inwards. The map is harmonic with mean
// value weights (Floater 2003), so that no triangle turns over in the domain. v is then stretched
// to measure the way along the surface. Throws InputError, which names the mesh, unless it is one
// piece, a manifold without handles, and open at the neck.
HeadDomain LayOutHead(const TriMesh& head, const std::string& name);

struct HeadSamples {
  std::vector<Vec3> points;  // mm
  std::vector<Vec2> uv;
};

// One sample for each (k / columns, m / rows), m = 0..rows, that a triangle covers. Between its
// corners a triangle is curved to meet their normals (PN triangles, Vlachos et al. 2001).
HeadSamples SampleHead(const HeadDomain& head, int columns, int rows);

}  // namespace semblance::problems
