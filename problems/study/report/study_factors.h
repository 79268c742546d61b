// SPDX-License-Identifier: GPL-3.0-or-later
// The factors of a study: the axes that its treatments combine completely.
#pragma once

#include <string>
#include <vector>

#include "problems/experiment/metrics/factor_effects.h"
#include "problems/study/study_tables.h"

namespace semblance::problems {

// An axis with two values or more.
struct StudyFactor {
  std::string name;                 // the option path of the axis
  std::vector<std::string> levels;  // in ascending order if it is ordered, else in that of the plan
  std::vector<double> positions;    // of the levels along an axis: their numbers, or 0, 1, 2, ...
  bool is_ordered = false;          // see OrderLevels
};

// Orders levels that are all numbers, or that differ in one number alone ("spread n=8", "spread
// n=16"). Beside such levels, `none` comes first and `all` last. Other levels keep their order, and
// the factor is not ordered.
StudyFactor OrderLevels(std::string name, std::vector<std::string> levels);

// The study's metric over the factors. An axis that always changes together with an earlier one
// (`zip`) is not a factor of its own, and neither is `title` if the other axes name the treatments.
struct FactorGrid {
  std::vector<StudyFactor> factors;   // in the order of the file; empty: see complaint
  std::vector<std::string> subjects;  // those with a value in every cell
  std::vector<std::string> left_out;  // subjects that lack a value in at least one cell
  GridValues values = {};             // Preference::Compared of the metric, one row per subject
  std::string complaint = {};         // why the treatments are no grid, as a sentence
};
FactorGrid FindFactorGrid(const StudyResults& results);

}  // namespace semblance::problems
