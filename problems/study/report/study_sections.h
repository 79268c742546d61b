// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of a study's report besides its ranking: charts, further tables, and identification.
#pragma once

#include <string>
#include <vector>

#include "problems/report/report_kit.h"
#include "problems/study/study_tables.h"

namespace semblance::problems {

// A plot for each axis whose values are all numbers and at least two: the metric's mean over
// subjects, one line for each combination of the other axes.
std::vector<ReportImage> AxisPlots(const StudyResults& results,
                                   const std::vector<Treatment>& ranked);

// The metric of each subject under each treatment, at most 40 of either. A cell links to its trial.
// Empty for a single treatment or a single subject.
std::vector<ReportImage> SubjectMap(const StudyResults& results,
                                    const std::vector<Treatment>& ranked);

// A larger study lists only the trials that are not done, so that browsers still open its report.
inline constexpr std::size_t kMostListedTrials = 10'000;

// The HTML id of a trial's row.
std::string TrialAnchor(const TrialRow& row);

// Returns the link of a trial: to its row, or in a study of more than kMostListedTrials to its
// trial.json.
std::string TrialHref(const StudyResults& results, const TrialRow& row);

// Tables with one row per treatment, in the order given, and means over subjects. A table without
// numbers is left out:
// - the siblings of the metric (RMS, mean, p95, ... of the same distances);
// - the metric in each part of the face (its `regions`);
// - proper scores of the depth (interp/evaluation/scores.h) over the true depth and over left-out
//   landmarks and sides that the scheme itself predicts; the differences of the scores from those
//   of the first treatment, paired by subject; the weights of averaged schemes;
// - cross-validation: RMS by landmark, side and random part, and the share within the stated 90 %;
// - the RMS over subjects of each landmark's error when it was left out, one row per site.
std::vector<ReportTable> Subtables(const StudyResults& results,
                                   const std::vector<Treatment>& ranked);

// Two sections on identification, by surfaces and by landmarks. Each has the cumulative match
// characteristics of the treatments, of the true face itself (ceiling) and of the generic face
// (floor), and a table of rank-1 and rank-5 shares, mean rank and, paired by subject, the ranks
// gained over the floor with Wilcoxon's p from six subjects on. The first section begins with the
// size of the gallery and warns if it is small. Empty for a study of another job.
std::vector<ReportSection> IdentifySections(const StudyResults& results,
                                            const std::vector<Treatment>& ranked);

}  // namespace semblance::problems
