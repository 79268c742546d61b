// SPDX-License-Identifier: GPL-3.0-or-later
// The variogram of depths: half the mean squared difference of two depths as a function of their
// distance (Cressie 1993, Statistics for Spatial Data, 2.4).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::interp {

struct VariogramBin {
  double distance_mm = kNaN;       // weighted mean over the bin's pairs
  double semivariance_mm2 = kNaN;  // half the weighted mean squared difference
  std::int64_t pairs = 0;          // > 0
};

// The model nugget + sill (1 - exp(-h / length)) at the distance h > 0, which belongs to the
// covariance matern_1_2.
struct VariogramModel {
  double nugget_mm2 = kNaN;  // >= 0; the limit at distance 0
  double sill_mm2 = kNaN;    // >= 0; the increase with distance
  double length_mm = kNaN;   // distance at which 63 % of the sill is reached

  double At(double distance_mm) const;  // mm^2
};

// Computes the variogram by straight distances, in bins of bin_mm (> 0) up to reach_mm (> 0),
// without empty bins. Values that are not finite are ignored. A pair is weighted by the product of
// its points' weights; with areas as weights the result does not depend on the local mesh density.
// If there are more than 1500 points, 1500 are sampled in equal steps of cumulative weight; a point
// that spans several steps counts that many times. weights: one per point, >= 0, or none for equal
// weights.
std::vector<VariogramBin> EmpiricalVariogram(std::span<const Vec3> points,
                                             std::span<const double> values,
                                             std::span<const double> weights, double bin_mm,
                                             double reach_mm);

// Fits the model that minimises the sum of pairs (semivariance / model - 1)^2 (Cressie 1985,
// Mathematical Geology 17). It tries 60 lengths in equal ratios, from the first bin's distance to
// three times the last bin's, with ten reweighted linear fits each. NaN for fewer than three bins
// or if no bin is above 0.
VariogramModel FitVariogram(std::span<const VariogramBin> bins);

}  // namespace semblance::interp
