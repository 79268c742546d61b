// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the meshes of scene.json (scene_json.h), and the dowels of a run's folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/report/pictures/image.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// A part of a layer in a colour of its own, e.g. an eye.
struct ScenePart {
  Colour colour;
  TriMesh mesh;
};

struct SceneMesh {
  std::string id;  // of the layer, e.g. "skull"
  TriMesh mesh;    // mm, LPS
  std::vector<ScenePart> parts = {};
};

// The layers with a mesh. Throws IoError if the file is missing or not the scene of a run.
std::vector<SceneMesh> ReadSceneMeshes(const std::filesystem::path& file);

// The layer of that id; null if there is none.
const SceneMesh* FindSceneMesh(const std::vector<SceneMesh>& meshes, std::string_view id);

// Site, base and tip of each dowel in dowels.csv that has a depth, as dowels along their tips.
// Throws IoError if the file is missing or lacks a column.
std::vector<Dowel> ReadRunDowels(const std::filesystem::path& file);

// Throws IoError unless the folder has the files of a run that hold its scene.
void CheckRunFolder(const std::filesystem::path& folder);

}  // namespace semblance::problems
