// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes in files: PLY, OBJ, STL and OFF, in mm.
#pragma once

#include <filesystem>
#include <limits>
#include <string>

#include "surfaces/mesh/tri_mesh.h"
#include "surfaces/mesh_files/mesh_attributes.h"

namespace semblance {

// Reads a mesh. All faces are kept as they are (also where edges are non-manifold), polygons fanned
// into triangles, equal corners of an STL merged. The format follows the extension (.ply .obj .stl
// .off); read_ply.h and its fellows say what is kept of it. Coordinates are single precision, but
// for PLY's doubles and whole numbers and for texts beyond 1024 mm (text_lines.h). Nothing wrong is
// skipped: throws IoError (no such file, unknown extension, empty) or InputError (no triangles, or
// anything in the file that is not of its format), naming the file and the line or byte. Memory
// follows the file's size, not its claims.
TriMesh ReadMesh(const std::filesystem::path& path);

// The bytes of a mesh file. extension: ".ply" (binary little-endian, all attributes), ".obj",
// ".off" or ".stl" (shape only). chord_mm: how far the triangles may be from what they stand for;
// infinity: not known. Coordinates are single precision; double in PLY, OBJ and OFF where steps of
// single precision at the largest of them are more than 1e-4 mm, a fiftieth of the chord, or 1e-5
// of the mesh's diagonal. A head's are not; those of a map are. STL is single by its format,
// whatever that loses. Throws InputError for another extension, for attributes of the wrong size,
// and for a non-manifold mesh as STL, which would lose faces of it.
std::string EncodeMesh(const TriMesh& mesh, const std::string& extension,
                       const MeshAttributes& attributes = {},
                       double chord_mm = std::numeric_limits<double>::infinity());

}  // namespace semblance
