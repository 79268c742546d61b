// SPDX-License-Identifier: GPL-3.0-or-later
// Conditions a table's depths on the facts known about one person (`tissue.given`). A model of few
// parameters replaces correlations that the table lacks.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/subject/dowel_depths.h"
#include "problems/subject/joint_normal.h"
#include "problems/subject/landmarks.h"

namespace semblance::problems {

// The correlations of the model, with one row and one column per name: the formula of
// SiteCorrelation with distances on the average skull. Sites that the average skull lacks correlate
// by `common`, and with their twins by common + twins. Names that are no sites are uncorrelated.
// `names` holds sites with their side, and other names, each once. The matrix is positive definite.
Eigen::MatrixXd ModelledCorrelation(const SiteCorrelation& options,
                                    std::span<const std::string> names);

// The joint distribution over people that a table states for a stratum. Its numbers are the names
// of the table's correlations. Without correlations they are those of `sites` that have an sd, and
// the model gives the correlations. Both sides of a pair have the mean and sd of their cell.
JointNormal MakeTableDistribution(const TissueTable& table, Sex sex, Build build,
                                  const SiteCorrelation& model, std::span<const std::string> sites);

// Conditions the depths that FillDepths took from a table on options.given. Each such dowel gets
// the expected depth and its standard deviation (joint_normal.h), plus options.sds of the latter,
// but at least 0.5 mm. A dowel whose own depth is known gets that depth, exactly if error_mm is 0.
// Does nothing if options.given is empty. The sd of a table is then the spread of people about its
// mean as published. It is not widened for the few subjects behind the table, as a prediction's is.
//
// Returns notes for people: the given facts, those that carry no information or lie more than 4 sd
// from the table's mean (of sd and error together), and the dowels that keep the table's depth
// because the table has no spread for them. Throws InputError for a site that is unknown or appears
// twice, a site in given.measured without a measured depth, a covariate that the table lacks, and a
// table without any sd. Throws IoError and ConfigError as ReadTissueTable.
std::vector<std::string> ConditionDepths(const TissueOptions& options,
                                         const LandmarkFile& landmarks, std::span<Dowel> dowels);

// True if ConditionDepths changes depths, so that the deviations of dowels refer to people with the
// facts known about this person, and not to all people.
bool IsConditioned(const TissueOptions& options);

}  // namespace semblance::problems
