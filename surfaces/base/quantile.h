// SPDX-License-Identifier: GPL-3.0-or-later
// Mean, median and quantiles, each by one definition for the whole program.
#pragma once

#include <span>
#include <vector>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

// Sum in index order, divided by the count; NaN for no values.
double ArithmeticMean(std::span<const double> values);

struct WeightedValue {
  double value = 0;
  double weight = 1;  // >= 0
};

// Returns the finite values in ascending order. weights: one per value, or none for equal weights.
std::vector<WeightedValue> SortedValues(std::span<const double> values,
                                        std::span<const double> weights = {});

// Quantile of weighted values, definition 2 of Hyndman & Fan (1996), R's type 2. It is the first of
// the sorted values whose cumulative weight exceeds `share` (0..1) of the total weight. If a
// value's cumulative weight equals the share (to 1e-12 of the total), the quantile is the mean of
// that value and the next. Hence the median of an even number of values is the mean of the middle
// two, and the shares 0 and 1 give the smallest and the largest value. R's default (type 7)
// interpolates between values, but has no accepted form with weights. NaN if the total weight is 0.
double Quantile(std::span<const WeightedValue> sorted, double share);

// The same for finite values of equal weight, in linear time. Reorders the values.
double Quantile(std::vector<double>& values, double share);

// The median, or the upper of the middle two. The result is one of the values, so that a bound
// computed from it is attained. values: at least one, no NaN. Reorders the values.
double UpperMedian(std::vector<double>& values);

}  // namespace semblance::surfaces
