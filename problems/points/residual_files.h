// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit leaves of each point, as a file.
#pragma once

#include <string>
#include <vector>

#include "fitting/plan/fit_result.h"
#include "problems/points/point_table.h"

namespace semblance {

// All must outlive it.
struct ResidualColumns {
  const FitResult& fit;
  const std::vector<PointAttribute>& attributes;   // as given
  const std::vector<std::vector<double>>& fitted;  // each of them, at the points
  const std::vector<double>& sigma_mm;             // of the surface at the points, or none
};

// A line per point, in the order of the table: its number, (u,v), distance, of an automatic fit 1
// for an outlier, the surface's sigma_mm if it is known, and of each attribute the fitted value and
// what the given one is more.
std::string ResidualsCsv(const ResidualColumns& columns);

// The same as binary PLY: vertices at (u, v, 0) with the scalars residual_mm, outlier, sigma_mm,
// NAME and NAME_residual, floats.
std::string ResidualsPly(const ResidualColumns& columns);

}  // namespace semblance
