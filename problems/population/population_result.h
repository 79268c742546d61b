// SPDX-License-Identifier: GPL-3.0-or-later
// The analysis of a population whose subjects are measured, and the files that hold its result.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "problems/io/output_folder.h"
#include "problems/population/depth_modes.h"
#include "problems/population/leave_one_out.h"
#include "problems/population/outliers.h"
#include "problems/population/population_run.h"
#include "problems/population/population_sample.h"

namespace semblance::problems {

struct PopulationResult {
  PopulationFile file;
  std::vector<MeasuredSubject> subjects;  // all subjects of the plan
  std::vector<int> counted;               // index into `subjects`, one per row of the sample
  JointSample sample;                     // without outliers if the options leave them out
  JointNormal joint;
  TissueTable table;
  std::vector<Outlier> outliers;  // their `subject` is an index into `subjects`
  std::vector<PredictedSites> predictions;
  DepthModes dense;
  std::vector<std::string> notes;

  int Count(const std::string& status) const;  // number of subjects with that status
  bool LooksForOutliers() const;               // false if too few subjects are measured
};

// The reason why there is no table; empty if three or more subjects are measured.
std::string WhyNoTable(const PopulationPlan& plan, const std::vector<MeasuredSubject>& subjects);

// Throws InputError if WhyNoTable has a reason or no two sites vary; throws Cancelled.
PopulationResult AnalysePopulation(const PopulationPlan& plan,
                                   std::vector<MeasuredSubject> subjects);

// A summary of a few lines for people.
std::string PopulationText(const PopulationResult& result);

// The files that WritePopulation writes.
inline constexpr std::array<std::string_view, 9> kPopulationFiles = {
    "table.yaml", "depths.csv", "subjects.csv",    "outliers.csv", "leave_one_out.csv",
    "dense.csv",  "dense.ply",  "population.json", "report.html"};

// Writes kPopulationFiles. The same result gives the same bytes.
void WritePopulation(const PopulationResult& result, OutputFolder& folder);

// Writes only subjects.csv, for a population without a table: the status of each subject, with the
// reason of a failure.
void WriteSubjects(const std::vector<MeasuredSubject>& subjects, OutputFolder& folder);

}  // namespace semblance::problems
