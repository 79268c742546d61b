// SPDX-License-Identifier: GPL-3.0-or-later
// Outliers: points whose residuals disagree with those of their neighbours.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "fitting/nested/leaf_sums.h"

namespace semblance::fitting {

// The standard deviation along one axis divided by the median of the distance, for normal errors
// along 1, 2 and 3 axes (index 1 .. 3).
inline constexpr std::array<double, 4> kSdOfMedian = {1, 1.4826, 0.8493, 0.6501};

// Returns residuals begin .. end - 1 of the sampled points, in their order. Valid until the next
// call.
using ResidualsBetween =
    std::function<std::span<const NestedResidual>(std::size_t begin, std::size_t end)>;

// Lower bounds of the standard deviation along one axis, so that tiny residuals are never outliers.
struct LeastSpread {
  double noise_mm = 0;     // for a point of mean weight; scaled by 1 / sqrt(weight) for others
  double rounding_mm = 0;  // for every point
};

// The treatment of points between 6 and 10 standard deviations if they are many.
enum class OutlierTail { kKeep, kReject };

// Decides for one point in `every` whether it is an outlier. A point is an outlier if
//   1. its offset (the residual less the median of the points around it) exceeds six standard
//      deviations, and
//   2. fewer than half of the eight points nearest to it have a similar residual. The standard
//      deviation is that of the points around it, by their median, so that up to a third of them
//      may be outliers; it is at least `least`. By the second condition, detail that the surface
//      does not follow yet is not an outlier, because neighbours share it. The limit falls with
//      the residuals as the surface becomes finer.
//
// Tail. Gross errors mostly lie far beyond ten standard deviations. If more than a fifth as many
// points lie between six and ten as beyond ten, the offsets have a tail, as at edges and steps that
// the surface is too coarse for; with OutlierTail::kKeep only points beyond ten are then outliers.
//
// Weights. A point's standard deviation is the larger of two: that of the points around it, and
// their noise scaled by the ratio of its own sigma to theirs. The first covers detail, the second
// noise. In the weighted medians a point counts by 1 / sigma, at most four times as much as the
// median point. A neighbour whose own noise hides an offset of this size is not used.
//
// outlier: one flag per point. Points that are flagged at the start do not enter the medians.
// Returns the number of outliers among the sampled points.
int FindOutliers(const NestedPoints& points, std::size_t every, const ResidualsBetween& residuals,
                 const LeastSpread& least, OutlierTail tail, std::vector<char>& outlier);

// Clears the flags of outliers that stand at a step. If one sheet of points goes behind another,
// a smooth surface is far from the points of both, and other points of their sheet stand next to
// them. If more than a tenth of the outliers (beyond the number expected by chance) meet a strict
// rule, two of the eight nearest points within a tenth of their distance from the surface, then all
// outliers that meet a loose rule, two of twenty within a fifth, are no outliers any more. Returns
// their number.
int ReinstateStepPoints(const NestedPoints& points, const ResidualsBetween& residuals,
                        const LeastSpread& least, std::vector<char>& outlier);

}  // namespace semblance::fitting
