// SPDX-License-Identifier: GPL-3.0-or-later
// The treatments of a study in the order of its metric, and the time that they took.
#pragma once

#include <string>
#include <vector>

#include "problems/study/study_tables.h"

namespace semblance::problems {

// The metric's mean over subjects. NaN without subjects.
double MeanOverSubjects(const Treatment& treatment);

// The treatments by the mean cost (Preference) of the study's metric, best first. Treatments
// without values come last.
std::vector<Treatment> RankTreatments(const StudyResults& results);

// The mean wall time of the treatment's trials that have one. NaN if none has. It does not contain
// work that another trial did for one of them.
double MeanSeconds(const StudyResults& results, const Treatment& treatment);

// The order of the ranking in words, e.g. "best mean first (higher is better)".
std::string RankingOrderText(const Preference& preference);

// An explanation of treatment labels for the head of a list, e.g. "; named by interp, rounds".
// Empty if the study names its treatments itself or has only one.
std::string LabelPartsText(const StudyResults& results);

// One line per treatment for a terminal: rank, mean, subjects, seconds and label. Lists the first
// twenty and counts the others. Empty if no trial has a value.
std::string RankingText(const StudyResults& results);

}  // namespace semblance::problems
