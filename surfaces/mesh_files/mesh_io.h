// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes in files: PLY, OBJ, STL and OFF, in mm.
#pragma once

#include <filesystem>
#include <string>

#include "surfaces/mesh/tri_mesh.h"
#include "surfaces/mesh_files/mesh_attributes.h"

namespace semblance {

// Reads a mesh. All faces are kept as they are (also where edges are non-manifold), polygons fanned
// into triangles, equal corners of an STL merged. The format follows the extension (.ply .obj .stl
// .off); read_ply.h and its fellows say what is kept of it. Coordinates are single precision, but
// for PLY's doubles and whole numbers. Nothing wrong is skipped: throws IoError (no such file,
// unknown extension, empty) or InputError (no triangles, or anything in the file that is not of its
// format), naming the file and the line or byte. Memory follows the file's size, not its claims.
TriMesh ReadMesh(const std::filesystem::path& path);

// The bytes of a mesh file. extension: ".ply" (binary little-endian, float coordinates, all
// attributes), or ".obj", ".stl", ".off" through OpenMesh (shape only). Throws InputError for
// another extension, for attributes of the wrong size, and for a non-manifold mesh in a format that
// would lose faces of it.
std::string EncodeMesh(const TriMesh& mesh, const std::string& extension,
                       const MeshAttributes& attributes = {});

}  // namespace semblance
