// SPDX-License-Identifier: GPL-3.0-or-later
// Quantiles, by one definition for all figures: medians, percentiles, quartiles and intervals.
#pragma once

#include <span>
#include <vector>

namespace semblance {

struct WeightedValue {
  double value = 0;
  double weight = 1;  // >= 0
};

// The finite ones of the values, ascending. weights: one per value, or none where all weigh the
// same.
std::vector<WeightedValue> SortedValues(std::span<const double> values,
                                        std::span<const double> weights = {});

// The value that `share` (0..1) of the weight does not exceed: the first of the sorted values up to
// which there is more than that share, or the mean of this one and the one before it where the
// share is met exactly between them (to 1e-12 of the weight). Definition 2 of Hyndman & Fan
// (1996), R's type 2, with weights. So the median of an even number is the mean of the two in the
// middle, and 0 and 1 give the least and the largest value. It does not interpolate between values,
// which R's default (type 7) does, because that has no accepted form with weights. NaN without any
// weight.
double Quantile(std::span<const WeightedValue> sorted, double share);

// The same of finite values that weigh the same, in time that grows with their number alone; leaves
// them in another order.
double Quantile(std::vector<double>& values, double share);

// The median, or of an even number the upper of the two in the middle: one of the values, so that a
// bound that is made of it is met by one. values: at least one, none NaN; in another order after.
double UpperMedian(std::vector<double>& values);

}  // namespace semblance
