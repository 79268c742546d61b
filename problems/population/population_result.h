// SPDX-License-Identifier: GPL-3.0-or-later
// What a population comes to once its subjects are measured.
#pragma once

#include <string>
#include <vector>

#include "problems/population/depth_modes.h"
#include "problems/population/leave_one_out.h"
#include "problems/population/outliers.h"
#include "problems/population/population_run.h"
#include "problems/population/population_table.h"

namespace semblance {

struct PopulationResult {
  PopulationFile file;
  std::vector<MeasuredSubject> subjects;  // all of the plan
  std::vector<int> counted;               // of them, those that the sample's rows are
  JointSample sample;                     // without outliers where those are left out
  JointNormal joint;
  TissueTable table;
  std::vector<Outlier> outliers;  // `subject`: of `subjects`
  std::vector<Foresight> foresights;
  DepthModes dense;
  std::vector<std::string> notes;

  int Count(const std::string& status) const;  // subjects of that status
  bool LooksForOutliers() const;               // else so few are measured that none can be told
};

// Empty where enough subjects are measured for a table, three or more; else what is lacking.
std::string WhyNoTable(const PopulationPlan& plan, const std::vector<MeasuredSubject>& subjects);

// Throws InputError as WhyNoTable says, or if no two sites vary; Cancelled.
PopulationResult AnalysePopulation(const PopulationPlan& plan,
                                   std::vector<MeasuredSubject> subjects);

// For people: a few lines.
std::string PopulationText(const PopulationResult& result);

}  // namespace semblance
