// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit leaves of each point, as a file.
#pragma once

#include <string>

#include "fitting/plan/fit_result.h"

namespace semblance {

// A line per point, in the order of the table: its number, (u,v), distance, and, of an automatic
// fit, 1 for an outlier.
std::string ResidualsCsv(const FitResult& fit);

// The same as binary PLY: vertices at (u, v, 0) with the scalars residual_mm and outlier, floats.
std::string ResidualsPly(const FitResult& fit);

}  // namespace semblance
