// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of a study: what grid, zip, list and sample set, one option path and value after the
// other.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "problems/config/config_errors.h"
#include "problems/config/config_tree.h"

namespace semblance {

struct StudySetting {
  std::string path;
  ConfigPlace path_place;
  ConfigNode value;
};
using StudyRow = std::vector<StudySetting>;

// The rows of the whole file: every combination of one row of grid, zip, list and sample each; one
// empty row if there is none of them. Faults go to `errors`.
std::vector<StudyRow> StudyRows(const ConfigNode& study, ConfigErrors& errors);

// n points of [0,1]^dimensions, one a line. lhs: one in each of n equal slices of each axis (McKay
// et al. 1979); sobol: the first n of the sequence after its origin.
enum class SampleMethod { kLhs, kSobol };
std::vector<std::vector<double>> UnitSamples(SampleMethod method, int n, int dimensions,
                                             std::uint64_t random_seed);

}  // namespace semblance
