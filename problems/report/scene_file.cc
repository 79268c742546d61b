// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "problems/report/view/view_mesh.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

// "#rrggbb"
Colour ColourFromText(const std::string& text) {
  return HexColour(static_cast<std::uint32_t>(
      std::strtoul(text.substr(std::min<std::size_t>(1, text.size())).c_str(), nullptr, 16)));
}

TriMesh MeshOf(const Json& part, const Json& blobs) {
  return DecodeMeshBlob(blobs.at(part.at("mesh").get<std::string>()));
}

SceneMesh ReadLayer(const Json& layer, const Json& blobs) {
  SceneMesh read{.id = layer.at("id").get<std::string>(), .mesh = MeshOf(layer, blobs)};
  for (const Json& part : layer.value("parts", Json::array())) {
    read.parts.push_back(
        {ColourFromText(part.at("colour").get<std::string>()), MeshOf(part, blobs)});
  }
  return read;
}

Vec3 ReadPoint(const CsvReader& csv, const char* name) {
  Vec3 point;
  for (const int axis : {0, 1, 2}) {
    point[axis] = csv.NumberOrNan(csv.RequireColumn(fmt::format("{}_{}_mm", name, "xyz"[axis])));
  }
  return point;
}

}  // namespace

std::vector<SceneMesh> ReadSceneMeshes(const std::filesystem::path& file) {
  std::vector<SceneMesh> meshes;
  try {
    const Json scene = ParseJson(ReadFileBytes(file), file.string());
    for (const Json& layer : scene.at("layers")) {
      if (layer.contains("mesh")) {
        meshes.push_back(ReadLayer(layer, scene.at("blobs")));
      }
    }
  } catch (const Json::exception& e) {
    throw IoError(fmt::format("{}: not the scene of a run: {}", file.string(), JsonFault(e)));
  } catch (const InputError& e) {
    throw IoError(fmt::format("{}: {}", file.string(), e.what()));
  }
  return meshes;
}

const SceneMesh* FindSceneMesh(const std::vector<SceneMesh>& meshes, std::string_view id) {
  const auto found = std::ranges::find(meshes, id, &SceneMesh::id);
  return found == meshes.end() ? nullptr : &*found;
}

std::vector<Dowel> ReadRunDowels(const std::filesystem::path& file) {
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  std::vector<Dowel> dowels;
  while (csv.NextRow()) {
    const Vec3 base = ReadPoint(csv, "base"), tip = ReadPoint(csv, "tip");
    if (!base.allFinite() || !tip.allFinite() || base == tip) {
      continue;  // without a depth
    }
    Dowel dowel;
    dowel.site = csv.Cell(csv.RequireColumn("site"));
    dowel.base = base;
    dowel.direction = (tip - base).normalized();
    dowel.depth_mm = (tip - base).norm();
    dowels.push_back(dowel);
  }
  return dowels;
}

void CheckRunFolder(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "result.json") ||
      !std::filesystem::exists(folder / "scene.json")) {
    throw IoError(fmt::format(
        "{}: not the folder of a run, because result.json or scene.json is missing; make one with "
        "semblance run",
        folder.string()));
  }
}

}  // namespace semblance::problems
