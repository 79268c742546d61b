// SPDX-License-Identifier: GPL-3.0-or-later
// How the depths of sites go together over people, by a model of few numbers: what a sample of
// people is shrunk to, and what stands in for one.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "problems/subject/dowel_depths.h"

namespace semblance {

// One row and column per name: the formula of SiteCorrelation, by distances on an average skull.
// Sites that it lacks (sites.h) share `common`, and with their twins `twins`; names that are no
// sites correlate with nothing. Positive definite. names: sites with their side, and others; each
// once.
Eigen::MatrixXd ModelledCorrelation(const SiteCorrelation& options,
                                    std::span<const std::string> names);

}  // namespace semblance
