// SPDX-License-Identifier: GPL-3.0-or-later
// The tables of a study's report that look behind its metric: the same error by other measures, by
// part of the face, and by left-out dowel.
#pragma once

#include <vector>

#include "problems/report/report.h"
#include "problems/study/study_tables.h"

namespace semblance {

// One row per treatment, in the order given; means over subjects. A table without a number is left
// out:
// - the metric's siblings (RMS, mean, p95, ... of the same distances);
// - the metric in each part of the face (`regions` beside it);
// - proper scores of the depth (interp/evaluation/scores.h): over the true depth, and over
// landmarks
//   left out where the scheme itself answers; and each treatment's CRPS less that of the first,
//   paired by subject; weights of schemes that are averaged;
// - cross-validation: RMS of what was left out by landmark, side and random part, and the share
//   within the stated 90 %;
// - the RMS over subjects of each landmark's error when it was left out, one row per site.
std::vector<ReportTable> Subtables(const StudyResults& results,
                                   const std::vector<Treatment>& ranked);

}  // namespace semblance
