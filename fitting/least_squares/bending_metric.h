// SPDX-License-Identifier: GPL-3.0-or-later
// The lengths in which bending is measured. Where a surface hardly bends along one direction, as a
// ridge along its crest, smoothness that counts bending more along it and less across it follows
// the surface with fewer points.
#pragma once

#include <Eigen/Core>
#include <array>

namespace semblance {

// What the matrix H of second derivatives along (s,t) is taken through: bending is tr((M H)^2),
// with M symmetric, positive definite and of determinant 1. The identity is the plane's own.
using BendingMetric = Eigen::Matrix2d;

// Along the direction bending counts stretch^2 times, across it 1 / stretch^2 times.
struct BendingStretch {
  double stretch = 1;        // >= 1
  double direction_deg = 0;  // from s towards t, in [0, 180)
};
BendingMetric MetricOf(const BendingStretch& stretch);
BendingStretch StretchOf(const BendingMetric& metric);

// Integrals of H_ss^2, H_st^2, H_tt^2, H_ss H_st, H_st H_tt and H_ss H_tt.
using BendingSums = std::array<double, 6>;
// What each of them counts in the integral of tr((M H)^2).
BendingSums BendingFactors(const BendingMetric& metric);
double BendingIn(const BendingMetric& metric, const BendingSums& sums);

// That in which a surface bends least; stretched at most so much.
BendingMetric MetricOfLeastBending(const BendingSums& sums, double most_stretch);
// As far beyond `to` as that is from `from`; stretched at most so much.
BendingMetric MetricBeyond(const BendingMetric& from, const BendingMetric& to, double most_stretch);
// How much one is stretched against the other, >= 1.
double StretchBetween(const BendingMetric& one, const BendingMetric& other);

}  // namespace semblance
