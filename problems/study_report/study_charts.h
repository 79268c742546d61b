// SPDX-License-Identifier: GPL-3.0-or-later
// The charts of a study: its metric along each axis of numbers, and subject by treatment.
#pragma once

#include <string>
#include <vector>

#include "problems/report/report.h"
#include "problems/study/study_tables.h"

namespace semblance {

// A plot for each axis that has two numbers or more, and nothing else: the metric's mean over
// subjects, a line for each combination of the other axes.
std::vector<ReportImage> AxisPlots(const StudyResults& results,
                                   const std::vector<Treatment>& ranked);

// The metric of each subject under each treatment, at most 40 of either; a cell leads to its trial.
// Empty of a single treatment or subject.
std::vector<ReportImage> SubjectMap(const StudyResults& results,
                                    const std::vector<Treatment>& ranked);

// The id of a trial's row in the page.
std::string TrialAnchor(const TrialRow& row);

}  // namespace semblance
