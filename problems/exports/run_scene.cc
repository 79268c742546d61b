// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/exports/run_scene.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "problems/exports/mesh_export.h"
#include "problems/pictures/mesh_primitives.h"
#include "problems/report/scene_blobs.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/mesh_files/glb.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

const GlbMaterial kBone{.name = "bone", .colour = {0.91, 0.86, 0.77}};
const GlbMaterial kRod{.name = "dowel", .colour = {0.70, 0.15, 0.12}, .roughness = 0.5};

GlbPart PartOf(const TriMesh& mesh, const GlbMaterial& material) {
  return {.material = material,
          .points = mesh.points,
          .normals = VertexNormals(mesh),
          .triangles = mesh.triangles};
}

GlbNode SkullNode(const fs::path& file) {
  try {
    const Json scene = ParseJson(ReadFileBytes(file), file.string());
    for (const Json& layer : scene.at("layers")) {
      if (layer.at("id") == "skull") {
        const Json& blob = scene.at("blobs").at(layer.at("mesh").get<std::string>());
        return {.name = "skull", .parts = {PartOf(MeshOfBlob(blob), kBone)}};
      }
    }
  } catch (const Json::exception& e) {
    throw IoError(fmt::format("{}: no scene of a run: {}", file.string(), JsonFault(e)));
  } catch (const InputError& e) {
    throw IoError(fmt::format("{}: {}", file.string(), e.what()));
  }
  throw IoError(fmt::format("{}: it holds no skull", file.string()));
}

GlbNode FaceNode(const fs::path& file) {
  CarriedMesh face = ReadCarriedMesh(file);
  GlbPart part = PartOf(face.mesh, {.name = "skin by value", .colour = {1, 1, 1}});
  part.colours = std::move(face.attributes.colors);
  return {.name = "face", .parts = {std::move(part)}};
}

Vec3 PointIn(const CsvReader& csv, const char* of_what) {
  Vec3 point;
  for (const int axis : {0, 1, 2}) {
    point[axis] = csv.NumberOrNan(csv.ColumnOf(fmt::format("{}_{}_mm", of_what, "xyz"[axis])));
  }
  return point;
}

GlbNode DowelsNode(const fs::path& file) {
  constexpr double kRod_mm = 0.9, kEnd_mm = 1.5;
  constexpr int kSides = 12, kRings = 6;
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  GlbNode dowels{.name = "dowels"};
  while (csv.NextRow()) {
    const Vec3 base = PointIn(csv, "base"), tip = PointIn(csv, "tip");
    if (!base.allFinite() || !tip.allFinite() || base == tip) {
      continue;  // without a depth
    }
    TriMesh rod = MakeCylinder(base, tip, kRod_mm, kSides);
    Append(rod, MakeSphere(tip, kEnd_mm, kRings));
    dowels.children.push_back({.name = fmt::format("dowel {}", csv.Cell(csv.ColumnOf("site"))),
                               .parts = {PartOf(rod, kRod)}});
  }
  return dowels;
}

}  // namespace

std::string RunGlb(const fs::path& folder) {
  if (!fs::exists(folder / "result.json") || !fs::exists(folder / "scene.json")) {
    throw IoError(fmt::format(
        "{}: no folder of a run; it has no result.json and scene.json: make one with semblance run",
        folder.string()));
  }
  const std::vector<GlbNode> nodes = {SkullNode(folder / "scene.json"),
                                      FaceNode(folder / "face.ply"),
                                      DowelsNode(folder / "dowels.csv")};
  return EncodeGlb(nodes);
}

}  // namespace semblance
