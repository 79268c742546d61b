// SPDX-License-Identifier: GPL-3.0-or-later
// A table's depths for one person of whom more is known: `tissue.given`.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/conditional/joint_normal.h"
#include "problems/subject/dowel_depths.h"
#include "problems/subject/landmarks.h"

namespace semblance {

// What a table says of people as one distribution, in a stratum: of the names of its correlations
// or, where it has none, of those of `sites` that have an sd, by the model. Both sides of a pair
// have the cell's mean and sd.
JointNormal JointOfTable(const TissueTable& table, Sex sex, Build build,
                         const SiteCorrelation& model, std::span<const std::string> sites);

// After FillDepths: each dowel whose depth is a table's gets the mean and the standard deviation
// that are to be expected given what options.given knows (joint_normal.h), plus options.sds of the
// latter, at least 0.5 mm. One that is known itself gets its depth, exactly where error_mm is 0.
// Does nothing where nothing is given: a table's own sd is then that of people about its mean, as
// it states it, and not that of a forecast, which would be widened for the few subjects behind it.
//
// Returns what people should know: what was given, what of it tells nothing or lies more than 4 sd
// from the table's mean (of the sd and its error together), and the dowels that keep the table's
// depth, as it says nothing of their spread. Throws InputError for a site that is unknown or
// appears twice, a site in given.measured without a measured depth, a covariate that the table has
// not, a table without any sd; IoError and ConfigError as ReadTissueTable.
std::vector<std::string> ConditionDepths(const TissueOptions& options,
                                         const LandmarkFile& landmarks, std::span<Dowel> dowels);

// The options with which a table's deviations are to be read: true where they are those of people
// with what is known of this one, and no longer of people at large.
bool IsConditioned(const TissueOptions& options);

}  // namespace semblance
