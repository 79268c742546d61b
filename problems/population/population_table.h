// SPDX-License-Identifier: GPL-3.0-or-later
// A population's depths as a tissue table: means, deviations, correlations, sample sizes.
#pragma once

#include "problems/population/population_file.h"
#include "problems/population/population_sample.h"
#include "problems/subject/tissue_table.h"

namespace semblance {

// Pooled ("adult"). A row per site; a site of one subject has a mean alone. Numbers are rounded to
// four decimals. `joint`: FitPopulation(sample).
TissueTable TableOf(const PopulationFile& file, const JointSample& sample,
                    const JointNormal& joint);

}  // namespace semblance
