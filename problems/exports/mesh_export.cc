// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/exports/mesh_export.h"

#include <fmt/format.h>

#include <set>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/glb.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/read_ply.h"
#include "surfaces/mesh_files/vtk_xml.h"

namespace semblance {
namespace {

std::string MeshGlb(const CarriedMesh& carried, const std::string& name) {
  const MeshAttributes& attributes = carried.attributes;
  const bool coloured = !attributes.colors.empty();
  GlbMaterial material{.name = name};
  if (coloured) {
    material.colour = {1, 1, 1};
  }
  const GlbNode node{.name = name,
                     .parts = {{.material = material,
                                .points = carried.mesh.points,
                                .normals = attributes.normals.empty() ? VertexNormals(carried.mesh)
                                                                      : attributes.normals,
                                .colours = attributes.colors,
                                .triangles = carried.mesh.triangles}}};
  return EncodeGlb({&node, 1});
}

}  // namespace

CarriedMesh ReadCarriedMesh(const std::filesystem::path& path) {
  CarriedMesh carried{.mesh = ReadMesh(path), .attributes = {}};
  const std::string extension = path.extension().string();
  if (extension == ".ply" || extension == ".PLY") {
    carried.attributes = ReadPlyAttributes(ReadFileBytes(path), path.string());
  }
  return carried;
}

std::string EncodeCarriedMesh(const CarriedMesh& carried, const std::string& extension,
                              const std::string& name) {
  static const std::set<std::string> kOfMeshes = {".ply", ".obj", ".off", ".stl"};
  if (extension == ".vtp") {
    return EncodeVtp(carried.mesh, carried.attributes);
  }
  if (extension == ".vtu") {
    return EncodeVtu(carried.mesh, carried.attributes);
  }
  if (extension == ".glb") {
    return MeshGlb(carried, name);
  }
  if (!kOfMeshes.contains(extension)) {
    throw InputError(
        fmt::format("export: '{}' is not a format for triangles; the file's name must end in .vtp "
                    ".vtu .glb .ply .obj .off or .stl",
                    extension));
  }
  return EncodeMesh(carried.mesh, extension, carried.attributes);
}

}  // namespace semblance
