// SPDX-License-Identifier: GPL-3.0-or-later
// What the 3-D view of a report shows, as JSON: layers, and the geometry that they are drawn from.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "problems/run.h"

namespace semblance {

// {label, facts, maps, layers, blobs} of one run. Layers, inner to outer: skull, dowels (base, tip,
// the fitted face's point, depth and residual), depth on the skull's shell, implicit and H-spline
// face with their signed error where the truth is known, true skin, one control net a level. Meshes
// are decimated to tens of thousands of triangles, points rounded to 1/65535 of the longest side
// (about 5 um), values to 0.01 mm. A blob is named by the hash of its content, so that scenes that
// share a skull can share its bytes. The same run gives the same text.
std::string SceneJson(const RunResult& result, const RunContext& context);

// Several scenes as one {scenes, blobs}, each blob once; labels: one per scene, shown where one is
// chosen. Scenes are taken in order while the whole stays below `limit_bytes`; at least one is.
// Throws IoError for a text that is no scene.
struct SceneText {
  std::string label;
  std::string json;
};
struct SceneCollection {
  std::string json;
  int count = 0;  // of scenes that were taken
};
SceneCollection CollectScenes(const std::vector<SceneText>& scenes, std::size_t limit_bytes);
// The same of a scene alone that is not yet a text.
std::string CollectScene(const std::string& label, nlohmann::ordered_json scene);

}  // namespace semblance
