// SPDX-License-Identifier: GPL-3.0-or-later
// The treatments of a study in the order of its metric, and the time that they took.
#pragma once

#include <string>
#include <vector>

#include "problems/study/study_tables.h"

namespace semblance::problems {

// The metric's mean over subjects. NaN without subjects.
double MeanOverSubjects(const Treatment& treatment);

// The treatments over their common subjects, in the same order: subjects and trials that not all of
// them have are left out, so that no treatment looks better because of its subjects. A treatment
// with fewer than half of the subjects of the fullest one is left empty instead, because it would
// take most subjects from all others. Without a common subject the treatments stay as they are.
std::vector<Treatment> RestrictToCommonSubjects(const StudyResults& results,
                                                std::vector<Treatment> treatments);

// A sentence on the subjects and treatments that RestrictToCommonSubjects leaves out, or a warning
// that there are no common subjects. Empty if all treatments have the same subjects.
std::string CommonSubjectsText(const std::vector<Treatment>& treatments);

// The treatments, with all their subjects, by the mean cost (Preference) of the study's metric over
// the common subjects, best first. Treatments without a place in that comparison come last.
std::vector<Treatment> RankTreatments(const StudyResults& results);

// The mean wall time of the treatment's trials that have one. NaN if none has. It does not contain
// work that another trial did for one of them.
double MeanSeconds(const StudyResults& results, const Treatment& treatment);

// The order of the ranking in words, e.g. "best mean first (higher is better)".
std::string RankingOrderText(const Preference& preference);

// An explanation of treatment labels for the head of a list, e.g. "; named by interp, rounds".
// Empty if the study names its treatments itself or has only one.
std::string LabelPartsText(const StudyResults& results);

// One line per treatment for a terminal: rank, mean over the common subjects, their number, seconds
// and label. Lists the first twenty and counts the others. Ends with CommonSubjectsText and
// MissingMetricText. Without a value it has the latter alone.
std::string RankingText(const StudyResults& results);

}  // namespace semblance::problems
