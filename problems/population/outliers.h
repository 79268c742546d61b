// SPDX-License-Identifier: GPL-3.0-or-later
// Finds depths and subjects that do not fit the others of their population.
#pragma once

#include <string>
#include <vector>

#include "problems/population/population_file.h"
#include "problems/population/population_sample.h"

namespace semblance::problems {

// The number of subjects with a depth at a site from which outliers are searched there. The median
// absolute deviation of fewer subjects is not reliable.
inline constexpr int kMinSubjectsForOutliers = 8;

struct Outlier {
  int subject = -1;           // row of the sample
  std::string site;           // empty: the subject as a whole
  double depth_mm = kNaN;     // depth of the site
  double expected_mm = kNaN;  // expected from the subject's other depths
  double z = kNaN;            // distance in robust deviations
};

// Finds outliers by a robust z = (e - median) / s over the subjects, where s is 1.4826 times the
// median absolute deviation.
//   A depth: e is the depth minus its expectation given the subject's other numbers, including
//   covariates, in the joint distribution. s is at least 0.2 mm.
//   A subject: e is the logarithm of the root mean square, over its sites, of (depth - median) / s.
//   Here s is at least 0.1.
// Sites that fewer than kMinSubjectsForOutliers subjects have are skipped. Depths come first in the
// result, in the order of the subjects.
std::vector<Outlier> FindOutliers(const JointSample& sample, const JointNormal& joint,
                                  const OutlierOptions& options);

// Sets the depths of outlying sites, and all numbers of outlying subjects, to NaN.
JointSample WithoutOutliers(JointSample sample, const std::vector<Outlier>& outliers);

}  // namespace semblance::problems
