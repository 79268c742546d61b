// SPDX-License-Identifier: GPL-3.0-or-later
// What a run leaves in its folder.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "problems/output/files.h"
#include "problems/pipeline/experiment.h"
#include "problems/run.h"

namespace semblance {

// What a run may write, its alternatives among it (given_files.h).
inline constexpr std::array<std::string_view, 19> kRunFiles = {
    "resolved.yaml", "result.json",   "dowels.csv",        "seeds.csv",       "face.hspline.json",
    "face.ply",      "implicit.ply",  "sample_*.ply",      "bust.*",          "bust_textures/*",
    "depth.ply",     "pictures/*",    "scene.json",        "provenance.json", "report.html",
    "timing.json",   "manifest.json", "alternatives.json", "alternatives/*"};

// Writes resolved.yaml, result.json, timing.json, face.hspline.json, face.ply, implicit.ply,
// depth.ply, dowels.csv, pictures/*.png, scene.json (for the report's 3-D view), provenance.json,
// report.html and, last, manifest.json: each whole or not at all, and the same bytes for the same
// experiment, timing.json apart. A folder without manifest.json holds no finished run.
void WriteRun(const Experiment& experiment, const RunResult& result, OutputFolder& folder,
              const RunContext& context);

// result.json: the metrics and counts; null, or NaN that is written as null, where there is no
// number.
nlohmann::ordered_json ResultJson(const Experiment& experiment, const RunResult& result);

}  // namespace semblance
