// SPDX-License-Identifier: GPL-3.0-or-later
// The mesh of a file, with all that its vertices carry, as the bytes of a file of another kind.
#pragma once

#include <filesystem>
#include <string>

#include "surfaces/mesh/tri_mesh.h"
#include "surfaces/mesh_files/mesh_attributes.h"

namespace semblance {

// A mesh and what its vertices carry: in a PLY normals, colours and values; in other files nothing.
struct CarriedMesh {
  TriMesh mesh;
  MeshAttributes attributes;
};

// Throws as ReadMesh.
CarriedMesh ReadCarriedMesh(const std::filesystem::path& path);

// extension, in lower case: .vtp and .vtu carry every value; .ply too; .glb colours and normals;
// .obj .off .stl the shape alone. name: of the mesh in a .glb. Throws InputError for another
// extension.
std::string EncodeCarriedMesh(const CarriedMesh& carried, const std::string& extension,
                              const std::string& name);

}  // namespace semblance
