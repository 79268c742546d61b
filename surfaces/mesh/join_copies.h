// SPDX-License-Identifier: GPL-3.0-or-later
// Makes one surface of a mesh whose file holds triangles twice or with corners of their own.
#pragma once

#include <string>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// The result does not depend on how a program wrote the surface:
//   - Triangles whose corners lie at the corners of an earlier triangle are dropped, in either
//     orientation: merged layers, double-sided exports, a mesh appended to itself. A triangle that
//     was there in both orientations takes the one of its neighbours; if all were, the surface
//     faces outwards.
//   - Border edges that lie on each other are joined: triangles that do not share their corners,
//     seams between patches.
// Corners lie at one place if they are closer than 1e-5 of the mesh's diagonal, or than four steps
// of single precision there. A mesh without such triangles and edges keeps its exact bits. Returns
// one line for each change, which begins with `name`.
std::vector<std::string> JoinCopies(TriMesh& mesh, const std::string& name);

}  // namespace semblance::surfaces
