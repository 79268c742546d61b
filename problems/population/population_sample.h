// SPDX-License-Identifier: GPL-3.0-or-later
// The measured subjects of a population as one table of numbers, and the distribution behind it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/conditional/fit_joint_normal.h"
#include "problems/population/subject_depths.h"

namespace semblance {

// A subject whose depths are there.
struct CountedSubject {
  PopulationSubject person;
  SubjectDepths depths;
};

// What is known of a person, by the names of CovariateNames(). A phantom's body mass index is made
// up: 25 at the thickness of an average adult, 0.45 more for each percent, and an error of 2 of its
// own seed.
std::map<std::string, double> CovariatesOf(const CountedSubject& subject);

// A row per subject; a column per site that any of them has, in the order of sites.h, and then per
// covariate. Depths at proposed landmarks of less than least_confidence are NaN.
JointSample SampleOf(const std::vector<CountedSubject>& subjects, double least_confidence);

// Whether a column is a site's depth, not a covariate.
bool IsSite(const std::string& name);

// Without the columns that fewer than two subjects have, or that are the same for all.
JointSample Varying(const JointSample& sample);

// The distribution of Varying(sample), shrunk to the model's correlations; the two sides of a pair
// have their mean's mean and the root of their variances' mean, as a table has it.
JointNormal FitPopulation(const JointSample& sample, const SiteCorrelation& model,
                          std::optional<double> shrinkage);

}  // namespace semblance
