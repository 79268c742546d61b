// SPDX-License-Identifier: GPL-3.0-or-later
// The files of a run.
#pragma once

#include <array>
#include <string_view>

#include "problems/experiment/experiment.h"
#include "problems/io/output_folder.h"
#include "problems/run.h"

namespace semblance::problems {

// Every file that a run may write, including its alternatives (given_files.h).
inline constexpr std::array<std::string_view, 19> kRunFiles = {
    "resolved.yaml", "result.json",   "dowels.csv",        "seeds.csv",       "face.hspline.json",
    "face.ply",      "implicit.ply",  "sample_*.ply",      "bust.*",          "bust_textures/*",
    "depth.ply",     "pictures/*",    "scene.json",        "provenance.json", "report.html",
    "timing.json",   "manifest.json", "alternatives.json", "alternatives/*"};

// Writes resolved.yaml, result.json, timing.json, face.hspline.json, face.ply, implicit.ply,
// depth.ply, dowels.csv, pictures/*.png, pictures/section_*.svg, scene.json (for the report's 3-D
// view), provenance.json, report.html and, last, manifest.json; with `report: false` no pictures,
// scene.json and report.html. Each file is written as a whole or
// not at all. The same experiment gives the same bytes, except for timing.json. A folder without
// manifest.json holds no finished run.
void WriteRun(const Experiment& experiment, const RunResult& result, OutputFolder& folder,
              const RunContext& context);

}  // namespace semblance::problems
