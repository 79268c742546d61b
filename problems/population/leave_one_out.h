// SPDX-License-Identifier: GPL-3.0-or-later
// Measures by cross-validation how well a population's table predicts a person who is not in it,
// with and without facts known about the person.
#pragma once

#include <string>
#include <vector>

#include "interp/evaluation/scores.h"
#include "problems/experiment/metrics/statistics.h"
#include "problems/population/population_file.h"
#include "problems/population/population_sample.h"

namespace semblance::problems {

struct PredictedDepth {
  int subject = -1;  // row of the sample
  std::string site;
  double depth_mm = kNaN, predicted_mm = kNaN, sd_mm = kNaN;
};

// The predictions of one method for the sites of all subjects.
struct PredictedSites {
  // The method. "mean": mean of the others; "person": given sex, build, age and body mass index as
  // far as they are known; "known": given the depths at PopulationFile::known; "person_known":
  // given both; otherwise the id of a published table, with a number if the name is taken.
  std::string name;
  std::vector<PredictedDepth> depths;
  DepthScores scores;             // over all depths
  std::vector<double> mae_mm;     // mean absolute error, one per subject; NaN without a depth
  SampleSummary against_mean_mm;  // over subjects: mae less that of "mean"
  int assumed = 0;  // for a table: subjects whose sex or build it needs and is not known
};

// Leaves out each subject in turn, estimates the distribution from the others, and compares the
// subject's depths with the predictions. Compares the sites that all methods predict, except those
// at `known` and their mirror sites. A table is read for the subject's sex and build; an unknown
// sex counts as male and an unknown build as normal. A subject that lacks one of the known depths
// is predicted from those that it has. The methods `person` and `person_known` are left out if no
// two subjects are known to differ in a covariate, `known` and `person_known` if no known site
// varies. The result is empty with fewer than three subjects.
std::vector<PredictedSites> LeaveOneOut(const PopulationFile& file,
                                        const std::vector<CountedSubject>& subjects,
                                        const JointSample& sample);

}  // namespace semblance::problems
