// SPDX-License-Identifier: GPL-3.0-or-later
// Wavefront OBJ.
#pragma once

#include <string>
#include <string_view>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The vertices (TextLines::NextPoint) and polygons of an OBJ, polygons fanned into triangles.
// Indices may be relative (-1 is the last vertex so far). A corner that repeats an earlier one of
// its face is left out, and with it a face without area. Texture, normals, groups, materials,
// lines and points are not kept. name: the file, for messages.
// Throws InputError with the line for anything else: an unknown keyword, fewer than 3 corners, an
// index out of range, a coordinate that is not finite.
TriMesh ReadObj(std::string_view bytes, const std::string& name);

}  // namespace semblance
