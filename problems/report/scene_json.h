// SPDX-License-Identifier: GPL-3.0-or-later
// The scenes of a report's 3-D view as JSON: layers and their geometry.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "problems/run.h"

namespace semblance::problems {

// {label, facts, faults, maps, layers, blobs} of one run. Faults are FaultMarks of the face. Layers
// from inner to outer: skull, dowels (base, tip, the fitted face's point, depth and residual),
// depth on the skull's shell, first and recovered face with their signed error if the truth is
// known, head, uncertainty, true skin, and one control net per level. Meshes are reduced to tens of
// thousands of triangles, points are rounded to 1/65535 of the longest side (about 5 um) and values
// to 0.01 mm (view_mesh.h). A blob is named by the hash of its content, so scenes can share the
// bytes of one skull. The same run gives the same text.
std::string SceneJson(const RunResult& result, const RunContext& context);

// Several scenes as one {scenes, blobs}, with each blob once. The label of a scene is its entry in
// the selection list. Takes scenes in order while the whole stays below `limit_bytes`, but at least
// one. Throws IoError for a text that is not a scene.
struct SceneText {
  std::string label;
  std::string json;
};
struct SceneCollection {
  std::string json;
  int count = 0;  // scenes taken
};
SceneCollection CollectScenes(const std::vector<SceneText>& scenes, std::size_t limit_bytes);
// The same for a single scene that is still JSON.
std::string CollectScene(const std::string& label, nlohmann::ordered_json scene);

}  // namespace semblance::problems
