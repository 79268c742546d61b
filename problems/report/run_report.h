// SPDX-License-Identifier: GPL-3.0-or-later
// report.html of a run, made from the files of its folder.
#pragma once

#include "problems/io/output_folder.h"

namespace semblance::problems {

// Writes report.html from result.json, resolved.yaml, dowels.csv, the pictures and, if it exists,
// scene.json of the folder. Throws IoError if a required file is missing or cannot be read.
void WriteReport(OutputFolder& folder);

}  // namespace semblance::problems
