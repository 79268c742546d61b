// SPDX-License-Identifier: GPL-3.0-or-later
// The report of a study, as one page.
#pragma once

#include <filesystem>
#include <string>

#include "problems/io/output_folder.h"
#include "problems/study/study_tables.h"

namespace semblance::problems {

// Writes trials.csv, trials_wide.csv, summary.csv, results.sqlite and report.html of the trials
// that the folder holds so far; notes count the missing ones. The report ranks the treatments by
// the study's metric, shows their spread, and compares each with the best one over the subjects
// that both have: effects first, p-values last, and no p-value below 6 subjects. The same study
// gives the same bytes, except for the seconds in report.html. Returns the results that were read.
// Throws IoError as ReadStudyResults.
StudyResults WriteStudyTables(OutputFolder& folder);

// Returns report.html of the results, which belong to this folder.
std::string StudyReportHtml(const StudyResults& results, const std::filesystem::path& folder);

}  // namespace semblance::problems
