// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes that cannot be laid out in one piece.
#pragma once

#include <string>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Throws InputError unless the mesh is one piece and every point belongs to a triangle.
//   refused: how the message begins.
void CheckOnePiece(const TriMesh& mesh, const std::string& refused);

}  // namespace semblance
