// SPDX-License-Identifier: GPL-3.0-or-later
// Geomview's Object File Format.
#pragma once

#include <string>
#include <string_view>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// Reads the vertices (TextLines::NextPoint) and polygons of a text OFF; polygons become triangles.
// Each vertex and each face is a line; comments begin with '#'. The header may be OFF with ST
// (texture), C (colours) and N (normals) before it; these are skipped, as are colours of faces.
// name: the file, for messages. Throws InputError with the line for anything else: OFF BINARY, four
// or n dimensions, counts that do not fit the file, fewer than 3 corners, an index out of range, a
// coordinate that is not finite.
TriMesh ReadOff(std::string_view bytes, const std::string& name);

}  // namespace semblance::surfaces
