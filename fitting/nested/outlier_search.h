// SPDX-License-Identifier: GPL-3.0-or-later
// Outliers: points that disagree with their neighbours.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "fitting/nested/leaf_sums.h"

namespace semblance {

// Standard deviation along one axis over the median of the distance, for normal errors along 1, 2
// and 3 axes.
inline constexpr std::array<double, 4> kSdOfMedian = {1, 1.4826, 0.8493, 0.6501};

// Residuals begin .. end - 1 of the points that are looked at, in their order; until the next call.
using ResidualsBetween =
    std::function<std::span<const NestedResidual>(std::size_t begin, std::size_t end)>;

// Standard deviations along one axis below which nothing is an outlier.
struct LeastSpread {
  double noise_mm = 0;     // of a point of mean weight; of others by their weight
  double rounding_mm = 0;  // of every point
};

// What becomes of points that are only somewhat too far, where they are many.
enum class OutlierTail { kStays, kGoes };

// Says of one point in `every` whether it is an outlier: its residual, less the median of the
// points around it, is more than six standard deviations of theirs (by their median, so that up to
// a third of them may be outliers too) and of `least`, and fewer than half of the eight
// points nearest to it have one like it. So detail that the surface does not follow yet, which
// neighbours share, is none, and the width falls with the residuals as the surface gets finer.
// Gross errors are a kind of their own, most of them much farther off. Where those between six and
// ten standard deviations are more than a fifth of those beyond, distances have a tail, as where a
// surface is too coarse for edges and steps; then only those beyond ten are outliers if the tail
// stays.
// With weights the standard deviation is that of the points around it times its own sigma over
// theirs, or theirs as it is, whichever is more: the one is what noise would do, the other what
// detail does. Points that are surer count more for the median, at most four times as much as most;
// and those whose own noise hides what is asked have no say.
// outlier: per point; what stands there when it begins has no vote. Returns how many there are.
int FindOutliers(const NestedPoints& points, std::size_t every, const ResidualsBetween& residuals,
                 const LeastSpread& least, OutlierTail tail, std::vector<char>& outlier);

// At a step, where one sheet of points goes behind another, a smooth surface is far from points of
// both, beside which others stand. Where more than a tenth of the outliers that FindOutliers has
// found, beyond what chance does, have two of the eight points nearest to them within a tenth of
// their distance from the surface, those with two of twenty within a fifth become none. Returns how
// many.
int SpareSheets(const NestedPoints& points, const ResidualsBetween& residuals,
                const LeastSpread& least, std::vector<char>& outlier);

}  // namespace semblance
