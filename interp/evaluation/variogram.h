// SPDX-License-Identifier: GPL-3.0-or-later
// How unlike depths are that lie some way apart: half their mean squared difference by distance
// (Cressie 1993, Statistics for Spatial Data, 2.4).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

struct VariogramBin {
  double distance_mm = kNaN;       // mean of the bin's pairs, by weight
  double semivariance_mm2 = kNaN;  // half the mean of their squared differences, by weight
  std::int64_t pairs = 0;          // above 0
};

// nugget + sill (1 - exp(-h / length)) at the distance h > 0: the covariance matern_1_2.
struct VariogramModel {
  double nugget_mm2 = kNaN;  // >= 0, of neighbours that all but touch
  double sill_mm2 = kNaN;    // >= 0, what distance adds to it
  double length_mm = kNaN;   // at which 63 % of it are reached

  double At(double distance_mm) const;  // mm^2
};

// Straight distances, in bins of bin_mm up to reach_mm; empty bins are left out. Values that are
// not finite take no part. A pair counts by the product of its points' weights, so that with areas
// as weights no figure depends on where a mesh is finer. Of more than 1500 points it takes 1500,
// evenly by weight in their order; one that weighs several steps counts so many times. weights: one
// per point, >= 0, or none for equal ones. bin_mm, reach_mm > 0.
std::vector<VariogramBin> EmpiricalVariogram(std::span<const Vec3> points,
                                             std::span<const double> values,
                                             std::span<const double> weights, double bin_mm,
                                             double reach_mm);

// The least sum of pairs (semivariance / model - 1)^2 (Cressie 1985, Mathematical Geology 17) over
// 60 lengths in even ratios from the first bin's distance to three times the last one's, by ten
// reweighted linear fits for each. NaN for fewer than three bins or none above 0.
VariogramModel FitVariogram(std::span<const VariogramBin> bins);

}  // namespace semblance
