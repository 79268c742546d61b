// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of a study: what grid, zip, list and sample set, one option path and value after the
// other.
#pragma once

#include <string>
#include <vector>

#include "problems/config/config_tree.h"
#include "problems/study/study_file.h"

namespace semblance {

using OptionSetting = OptionValues::Entry;
using StudyRow = std::vector<OptionSetting>;

// A plan holds each of its trials with all options.
inline constexpr double kMostTrials = 100'000;

// Whether subjects and rows make more trials than that, in words, known before one is made; empty
// if they do not.
std::string ComplaintAboutSize(const StudyFile& study);

// The rows of the whole file: every combination of one row of grid, zip, list and sample each; one
// empty row if there is none of them. Faults go to `errors`.
std::vector<StudyRow> StudyRows(const StudyFile& study, ConfigErrors& errors);

// Sets the option in an experiment's tree; `defaults` as for SetPath. A path that leads nowhere is
// an error at its location.
void ApplySetting(const OptionSetting& setting, const ConfigNode& defaults, ConfigNode& tree,
                  ConfigErrors& errors);

}  // namespace semblance
