// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes in files: PLY, OBJ, STL and OFF, in mm.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"
#include "surfaces/mesh_files/mesh_attributes.h"

namespace semblance::surfaces {

// The axes that a file states, as 3D Slicer does by SPACE=LPS or SPACE=RAS in a comment of the
// header or in the words of an STL. LPS: +x subject left, +y posterior, +z up. RAS is LPS with x
// and y negated.
enum class MeshAxes { kUnstated, kLps, kRas };

struct MeshFile {
  TriMesh mesh;  // as written
  MeshAxes axes = MeshAxes::kUnstated;
};

// Reads a mesh; the format follows the extension (.ply .obj .stl .off). All faces are kept as they
// are, also where edges are non-manifold. Polygons become triangles, and equal corners of an STL
// become one point; read_ply.h, read_obj.h, read_off.h and read_stl.h give the details. Coordinates
// are single precision, except doubles and whole numbers in a PLY, and texts beyond 1024 mm
// (text_lines.h). No fault is skipped: throws IoError (no such file, unknown extension, empty) or
// InputError (no triangles, or anything that does not belong to the format), with the file and the
// line or byte; an InputError also for SPACE= with other axes, and for two that differ. Memory
// follows the size of the file, not the counts in its header.
MeshFile ReadMeshFile(const std::filesystem::path& path);

// The axes that the header of a mesh file states. Throws IoError if it cannot be read.
MeshAxes ReadStatedAxes(const std::filesystem::path& path);

// Reads a mesh and turns it to LPS if the file states RAS, which adds a line to `notes`.
TriMesh ReadMeshInLps(const std::filesystem::path& path, std::vector<std::string>& notes);

// Reads a mesh for which nobody reads notes, and refuses one whose file states RAS.
TriMesh ReadMesh(const std::filesystem::path& path);

// Returns the bytes of a mesh file. extension: ".ply" (binary little-endian, with all attributes),
// ".obj", ".off" or ".stl" (shape only). chord_mm: how far the triangles may be from the surface
// that they approximate; infinity if unknown. Coordinates are single precision. In PLY, OBJ and OFF
// they are double if the steps of single precision at the largest coordinate exceed 1e-4 mm, a
// fiftieth of the chord, or 1e-5 of the mesh's diagonal; this holds for a map, not for a head. STL
// has single precision only. Throws InputError for another extension and for attributes of the
// wrong size.
std::string EncodeMesh(const TriMesh& mesh, const std::string& extension,
                       const MeshAttributes& attributes = {},
                       double chord_mm = std::numeric_limits<double>::infinity());

}  // namespace semblance::surfaces
