// SPDX-License-Identifier: GPL-3.0-or-later
// The measured subjects of a population as one sample, the joint distribution fitted to it, and the
// tissue table made of it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/population/population_file.h"
#include "problems/population/subject_depths.h"
#include "problems/subject/joint_normal.h"
#include "problems/subject/tissue_table.h"

namespace semblance::problems {

// A measured subject that counts in the sample.
struct CountedSubject {
  PopulationSubject person;
  SubjectDepths depths;
};

// The known covariates of a person, by the names of CovariateNames(). A phantom's body mass index
// is made up: 25 at the thickness of an average adult, 0.45 more per percent of thickness, plus a
// random error with sd 2 from the phantom's seed.
std::map<std::string, double> KnownCovariates(const CountedSubject& subject);

// Makes a sample with a row per subject. Its columns are the sites that any subject has, in the
// order of sites.h, and then the covariates. Depths at proposed landmarks below least_confidence
// are NaN.
JointSample MakeSample(const std::vector<CountedSubject>& subjects, double least_confidence);

// Removes the columns that fewer than two subjects have, or that are the same for all.
JointSample Varying(const JointSample& sample);

// Fits the joint distribution of Varying(sample), shrunk towards the model's correlations. Both
// sides of a pair get the mean of their means and the root of the mean of their variances, because
// a tissue table has one row per pair.
JointNormal FitPopulation(const JointSample& sample, const SiteCorrelation& model,
                          std::optional<double> shrinkage);

// Makes a pooled table ("adult") with a row per site. A site that only one subject has gets a mean
// without sd. Numbers are rounded to four decimals. `joint` must be FitPopulation(sample).
TissueTable MakeTissueTable(const PopulationFile& file, const JointSample& sample,
                            const JointNormal& joint);

}  // namespace semblance::problems
