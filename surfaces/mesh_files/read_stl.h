// SPDX-License-Identifier: GPL-3.0-or-later
// STL, text or binary.
#pragma once

#include <string>
#include <string_view>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// Reads the triangles of an STL. Corners that are equal in single precision become one point;
// points are in the order of their first use. A triangle with two equal corners is dropped, as
// slicers and mesh libraries do, but its points stay. Normals and attributes are skipped. name: the
// file, for messages. Throws InputError with the line (text) or byte (binary) for anything else: a
// size other than the header says, facets of other than 3 vertices, a coordinate that is not
// finite.
TriMesh ReadStl(std::string_view bytes, const std::string& name);

}  // namespace semblance::surfaces
