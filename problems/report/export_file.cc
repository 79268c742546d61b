// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/export_file.h"

#include <fmt/format.h>

#include <set>
#include <utility>
#include <vector>

#include "problems/report/scene_file.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/hspline_files/face_export.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/mesh/mesh_primitives.h"
#include "surfaces/mesh_files/glb.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/read_ply.h"
#include "surfaces/mesh_files/vtk_xml.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// ---------------------------------------------------------------------------------------------
// A mesh with the values of its vertices
// ---------------------------------------------------------------------------------------------

// A PLY gives attributes, other files do not.
struct CarriedMesh {
  TriMesh mesh;
  MeshAttributes attributes;
};

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

// Throws as ReadMesh.
CarriedMesh ReadCarriedMesh(const std::filesystem::path& path) {
  CarriedMesh carried{.mesh = ReadMesh(path), .attributes = {}};
  const std::string extension = path.extension().string();
  if (extension == ".ply" || extension == ".PLY") {
    carried.attributes = ReadPlyAttributes(ReadFileBytes(path), path.string());
  }
  return carried;
}

// `extension` is in lower case. `name` is the name of the mesh in a .glb. Throws InputError for an
// extension that is not a format for triangles.
std::string EncodeCarriedMesh(const CarriedMesh& carried, const std::string& extension,
                              const std::string& name) {
  static const std::set<std::string> kPlainFormats = {".ply", ".obj", ".off", ".stl"};
  if (extension == ".vtp") {
    return EncodeVtp(carried.mesh, carried.attributes);
  }
  if (extension == ".vtu") {
    return EncodeVtu(carried.mesh, carried.attributes);
  }
  if (extension == ".glb") {
    return MeshGlb(carried, name);
  }
  if (!kPlainFormats.contains(extension)) {
    throw InputError(
        fmt::format("export: '{}' is not a format for triangles; the file's name must end in .vtp "
                    ".vtu .glb .ply .obj .off or .stl",
                    extension));
  }
  return EncodeMesh(carried.mesh, extension, carried.attributes);
}

// ---------------------------------------------------------------------------------------------
// The folder of a run as one scene
// ---------------------------------------------------------------------------------------------

const GlbMaterial kBone{.name = "bone", .colour = {0.91, 0.86, 0.77}};
const GlbMaterial kRod{.name = "dowel", .colour = {0.70, 0.15, 0.12}, .roughness = 0.5};

GlbPart MakePart(const TriMesh& mesh, const GlbMaterial& material) {
  return {.material = material,
          .points = mesh.points,
          .normals = VertexNormals(mesh),
          .triangles = mesh.triangles};
}

GlbNode SkullNode(const fs::path& file) {
  const std::vector<SceneMesh> meshes = ReadSceneMeshes(file);
  const SceneMesh* const skull = FindSceneMesh(meshes, "skull");
  if (skull == nullptr) {
    throw IoError(fmt::format("{}: it holds no skull", file.string()));
  }
  return {.name = "skull", .parts = {MakePart(skull->mesh, kBone)}};
}

GlbNode FaceNode(const fs::path& file) {
  CarriedMesh face = ReadCarriedMesh(file);
  GlbPart part = MakePart(face.mesh, {.name = "skin by value", .colour = {1, 1, 1}});
  part.colours = std::move(face.attributes.colors);
  return {.name = "face", .parts = {std::move(part)}};
}

GlbNode DowelsNode(const fs::path& file) {
  constexpr double kRod_mm = 0.9, kEnd_mm = 1.5;
  constexpr int kSides = 12, kRings = 6;
  GlbNode dowels{.name = "dowels"};
  for (const Dowel& dowel : ReadRunDowels(file)) {
    TriMesh rod = MakeCylinder(dowel.base, dowel.Tip(), kRod_mm, kSides);
    Append(rod, MakeSphere(dowel.Tip(), kEnd_mm, kRings));
    dowels.children.push_back(
        {.name = fmt::format("dowel {}", dowel.site), .parts = {MakePart(rod, kRod)}});
  }
  return dowels;
}

std::string RunGlb(const fs::path& folder) {
  CheckRunFolder(folder);
  const std::vector<GlbNode> nodes = {SkullNode(folder / "scene.json"),
                                      FaceNode(folder / "face.ply"),
                                      DowelsNode(folder / "dowels.csv")};
  return EncodeGlb(nodes);
}

void RefuseChord(const fs::path& from, const ExportOptions& options) {
  if (options.chord_mm) {
    throw InputError(fmt::format(
        "{}: its triangles are exported unchanged; omit --chord_mm, or export the H-spline "
        "(face.hspline.json)",
        from.string()));
  }
}

std::string RunBytes(const fs::path& folder, const ExportOptions& options) {
  RefuseChord(folder, options);
  if (LowerCase(options.extension) != ".glb") {
    throw InputError(
        fmt::format("{}: the folder of a run is exported as .glb with skull, face and dowels; for "
                    "'{}' choose one of its "
                    "files: face.ply, depth.ply, implicit.ply or face.hspline.json",
                    folder.string(), options.extension));
  }
  return RunGlb(folder);
}

std::string MeshBytes(const fs::path& file, const ExportOptions& options) {
  RefuseChord(file, options);
  return EncodeCarriedMesh(ReadCarriedMesh(file), LowerCase(options.extension),
                           file.stem().string());
}

}  // namespace

std::string ExportedBytes(const fs::path& from, const ExportOptions& options) {
  static const std::set<std::string> kMeshes = {".ply", ".obj", ".off", ".stl"};
  if (fs::is_directory(from)) {
    return RunBytes(from, options);
  }
  if (kMeshes.contains(LowerCase(from.extension().string()))) {
    return MeshBytes(from, options);
  }
  return EncodeFace(ReadHSpline(from), options.extension, options.chord_mm, options.threads);
}

}  // namespace semblance::problems
