// SPDX-License-Identifier: GPL-3.0-or-later
// How well a population's table, and what it says given something of a person, predicts a person
// who is not in it.
#pragma once

#include <string>
#include <vector>

#include "interp/evaluation/scores.h"
#include "problems/metrics/statistics.h"
#include "problems/population/population_file.h"
#include "problems/population/population_sample.h"

namespace semblance {

struct PredictedDepth {
  int subject = -1;  // row of the sample
  std::string site;
  double depth_mm = kNaN, predicted_mm = kNaN, sd_mm = kNaN;
};

// One way of predicting.
struct Foresight {
  std::string name;  // mean; person: given sex, build, age and body mass index as far as they are
                     // known; known: given the depths at PopulationFile::known; person_known: given
                     // both; else the id of a published table, with a number if it is taken
  std::vector<PredictedDepth> depths;
  DepthScores scores;             // over all of them
  std::vector<double> mae_mm;     // one per subject; NaN without a depth
  SampleSummary against_mean_mm;  // per subject: its mae less that of `mean`
  int assumed = 0;  // of a table: subjects whose sex or build it asks for and is not known
};

// Each subject in turn: the distribution is found again from the others alone, and the subject's
// depths are compared with it. Compared are the sites that all ways predict, but for those at
// `known` and their other sides. Tables are taken for sex and build as far as they are known, else
// male and normal. Subjects without one of the known depths are predicted by those that they have.
// `person` and `person_known` are left out where no two subjects are known to differ in anything,
// `known` and `person_known` where none of its sites varies.
// Empty with fewer than three subjects.
std::vector<Foresight> LeaveOneOut(const PopulationFile& file,
                                   const std::vector<CountedSubject>& subjects,
                                   const JointSample& sample);

}  // namespace semblance
