// SPDX-License-Identifier: GPL-3.0-or-later
// What a study found, as one page.
#pragma once

#include "problems/output/files.h"
#include "problems/study/study_tables.h"

namespace semblance {

// Writes trials.csv, summary.csv, results.sqlite and report.html of what is in the folder so far;
// what is missing is counted and said. The report ranks the treatments by the study's metric, shows
// their spread, and compares each with the best over the subjects that have both: effect first,
// p-values last, and none below 6 subjects. In report.html the seconds differ from run to run; all
// else is the same bytes for the same study. Returns what was read. Throws IoError as
// ReadStudyResults.
StudyResults WriteStudyTables(OutputFolder& folder);

}  // namespace semblance
