// SPDX-License-Identifier: GPL-3.0-or-later
// Which treatment of a study is best, and for how long each trial ran.
#pragma once

#include <string>
#include <vector>

#include "problems/study/study_tables.h"

namespace semblance {

// The metric's mean over subjects; NaN without one.
double MeanOf(const Treatment& treatment);

// The treatments by the study's metric, best mean cost (Preference) first; those without values
// last.
std::vector<Treatment> Ranked(const StudyResults& results);

// The mean wall time of the treatment's trials, of those that say it; NaN if none does. Work that
// another trial did for one is not in it.
double MeanSeconds(const StudyResults& results, const Treatment& treatment);

// "best mean first (higher is better)": how they are ranked.
std::string BestFirst(const Preference& preference);

// What the parts of a treatment's name are, for the head of a list of them: "; named by interp,
// rounds". Empty where the study names its treatments itself, or has one alone.
std::string WordsOfNames(const StudyResults& results);

// A line per treatment for a terminal: rank, mean, subjects, seconds and label; the first twenty,
// and how many more there are. Empty where no trial has a value.
std::string RankingText(const StudyResults& results);

}  // namespace semblance
