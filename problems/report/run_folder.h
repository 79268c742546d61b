// SPDX-License-Identifier: GPL-3.0-or-later
// What a run leaves in its folder.
#pragma once

#include <string>

#include "problems/output/files.h"
#include "problems/pipeline/experiment.h"
#include "problems/run.h"

namespace semblance {

// Writes resolved.yaml, result.json, timing.json, face.hspline.json, face.ply, implicit.ply,
// depth.ply, dowels.csv, pictures/*.png, scene.json (for the report's 3-D view), provenance.json,
// report.html and, last, manifest.json: each whole or not at all, and the same bytes for the same
// experiment, timing.json apart. A folder without manifest.json holds no finished run.
void WriteRun(const Experiment& experiment, const RunResult& result, OutputFolder& folder,
              const RunContext& context);

// result.json: the metrics and counts; null where there is no number.
std::string ResultJson(const Experiment& experiment, const RunResult& result);

}  // namespace semblance
