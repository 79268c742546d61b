// SPDX-License-Identifier: GPL-3.0-or-later
// PLY: text, binary little-endian and binary big-endian.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"
#include "surfaces/mesh_files/mesh_attributes.h"

namespace semblance {

// The positions x, y, z of element 'vertex' and the polygons vertex_indices (or vertex_index) of
// element 'face', polygons fanned into triangles; coordinates of type double and of whole types
// keep all their digits. Other properties and elements are not kept. name: the file, for messages.
// Throws InputError with the line (text) or byte (binary) for anything else: data shorter or longer
// than the header says, fewer than 3 corners, an index out of range, a coordinate that is not
// finite.
TriMesh ReadPly(std::string_view bytes, const std::string& name);

// The property `scalar` of every vertex, in order, of whatever number type; may be NaN. Throws
// InputError as ReadPly, and if a vertex has no such property or it is a list.
std::vector<double> PlyVertexScalar(std::string_view bytes, const std::string& scalar,
                                    const std::string& name);

// All that the vertices carry beside x, y, z: nx, ny, nz as normals, where all three are there;
// red, green, blue as colours, where all three are of type uchar; every other plain property as a
// scalar of its own name, in the file's order. Lists are not kept. Throws InputError as ReadPly.
MeshAttributes ReadPlyAttributes(std::string_view bytes, const std::string& name);

}  // namespace semblance
