// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of a study: what grid, zip, list and sample set, one option path and value after the
// other.
#pragma once

#include <vector>

#include "problems/config/config_errors.h"
#include "problems/study/study_file.h"

namespace semblance {

using OptionSetting = OptionValues::Entry;
using StudyRow = std::vector<OptionSetting>;

// The rows of the whole file: every combination of one row of grid, zip, list and sample each; one
// empty row if there is none of them. Faults go to `errors`.
std::vector<StudyRow> StudyRows(const StudyFile& study, ConfigErrors& errors);

// Sets the option in an experiment's tree; `defaults` as for SetPath. A path that leads nowhere is
// an error at its place.
void ApplySetting(const OptionSetting& setting, const ConfigNode& defaults, ConfigNode& tree,
                  ConfigErrors& errors);

}  // namespace semblance
