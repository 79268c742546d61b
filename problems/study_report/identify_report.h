// SPDX-License-Identifier: GPL-3.0-or-later
// What a study of identification found: cumulative match characteristics, between a ceiling and a
// floor.
#pragma once

#include <vector>

#include "problems/report/report.h"
#include "problems/study/study_tables.h"

namespace semblance {

// Two sections, of surfaces and of landmarks: the curves of each treatment, of the true face seen
// again (ceiling) and of the generic face (floor), and a table of rank-1 and rank-5 shares, mean
// rank and, paired by subject, the ranks gained over the floor with Wilcoxon's p from six subjects
// on. The first begins with the size of the gallery, and says so where it is small. Empty for a
// study of another job.
std::vector<ReportSection> IdentifySections(const StudyResults& results,
                                            const std::vector<Treatment>& ranked);

}  // namespace semblance
