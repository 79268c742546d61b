// SPDX-License-Identifier: GPL-3.0-or-later
// A whole head, ears and all, over one (u,v).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The head's mesh with its holes closed, and where its points lie in the domain. u goes round the
// head, from the back (0) over the subject's right side, the face (0.5) and the left side (1 is 0
// again); v goes from the border of the neck (0) to the crown (1), where all u meet.
struct HeadDomain {
  TriMesh mesh;          // mm, LPS; the points of the head first, in their order
  std::vector<Vec2> uv;  // one per point; u in [0,1), v in [0,1]
  int crown = -1;        // the point where v is 1; its u means nothing
  std::vector<std::vector<std::int32_t>> rims;  // the points round each hole that was closed
};

// The longest border of the mesh is that of the neck. Each other one (an eye's opening, the
// mouth's) is closed by a pocket that goes inwards. The map is harmonic with mean value weights
// (Floater 2003), so that no triangle is turned over in the domain; v is then stretched so that it
// measures the way along the surface. Throws InputError, naming the mesh, unless it is one piece, a
// manifold, without handles, and open at the neck.
HeadDomain LayOutHead(const TriMesh& head, const std::string& name);

}  // namespace semblance
