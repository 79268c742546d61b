// SPDX-License-Identifier: GPL-3.0-or-later
// report.html of a run, from the files of its folder alone.
#pragma once

#include "problems/output/files.h"

namespace semblance {

// Builds report.html anew from result.json, resolved.yaml, dowels.csv, the pictures and, where it
// is there, scene.json of a run's folder. Throws IoError if one is missing or cannot be read.
void WriteReport(OutputFolder& folder);

}  // namespace semblance
