// SPDX-License-Identifier: GPL-3.0-or-later
// What a study found, as one page.
#pragma once

#include <string>
#include <vector>

#include "problems/output/files.h"
#include "problems/report/report.h"
#include "problems/report/scene_json.h"
#include "problems/study/study_tables.h"

namespace semblance {

// Writes trials.csv, summary.csv, results.sqlite and report.html of what is in the folder so far;
// what is missing is counted and said. Returns what was read. Throws IoError as ReadStudyResults.
StudyResults WriteStudyTables(OutputFolder& folder);

// Ranks the treatments by the study's metric, shows their spread, and compares each with the best
// over the subjects that have both: effect first, p-values last, and none below 6 subjects. scenes:
// of the trials that the 3-D view offers side by side (CollectScenes); may be empty.
// maps: pictures of the first subject's depth, one per treatment; may be empty.
std::string StudyReportHtml(const StudyResults& results, const SceneCollection& scenes = {},
                            const std::vector<ReportImage>& maps = {});

}  // namespace semblance
