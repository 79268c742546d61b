// SPDX-License-Identifier: GPL-3.0-or-later
// A comparison of studies as text, as CSV tables and as a page.
#pragma once

#include <string>

#include "problems/io/output_folder.h"
#include "problems/study/report/study_comparison.h"

namespace semblance::problems {

// For a terminal: one line per treatment, then one per pair.
std::string ComparisonText(const StudyComparison& comparison);

// One line per pair: study, treatment, reference_study, reference, subjects, mean_difference,
// mean_low_95, mean_high_95, better, worse, p, p_holm. A missing number is an empty cell.
std::string PairsCsv(const StudyComparison& comparison);

// One line per treatment and subject: study, treatment, subject, metric, value.
std::string ComparedCsv(const StudyComparison& comparison);

// Writes pairs.csv, values.csv and report.html.
void WriteComparison(const StudyComparison& comparison, OutputFolder& folder);

}  // namespace semblance::problems
