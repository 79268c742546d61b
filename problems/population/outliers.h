// SPDX-License-Identifier: GPL-3.0-or-later
// Depths, and subjects, that do not look like the others of their population.
#pragma once

#include <string>
#include <vector>

#include "problems/population/population_file.h"
#include "problems/population/population_sample.h"

namespace semblance {

// Subjects with a depth at a site for outliers to be looked for there: a median of fewer says
// nothing.
inline constexpr int kFewestForOutliers = 8;

struct Outlier {
  int subject = -1;           // row of the sample
  std::string site;           // empty: the subject as a whole
  double depth_mm = kNaN;     // of a site
  double expected_mm = kNaN;  // by the subject's other depths
  double z = kNaN;            // robust deviations
};

// A depth: with e its distance from what the subject's other numbers let expect (of the joint
// distribution; covariates count too), z = (e - median) / s over the subjects that have the site, s
// 1.4826 times the median absolute deviation and at least 0.2 mm. A subject: likewise the logarithm
// of the root mean square over its sites of (depth - median) / s, s at least 0.1. Nothing where
// fewer than kFewestForOutliers subjects have a site. Sites first, in the order of the subjects.
std::vector<Outlier> FindOutliers(const JointSample& sample, const JointNormal& joint,
                                  const OutlierOptions& options);

// The sample with the depths of outlying sites, and all of outlying subjects, NaN.
JointSample WithoutOutliers(JointSample sample, const std::vector<Outlier>& outliers);

}  // namespace semblance
