// SPDX-License-Identifier: GPL-3.0-or-later
// The least of a smooth cost of a few numbers within bounds.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "surfaces/base/run_context.h"

namespace semblance {

struct SearchRange {
  Eigen::VectorXd low, high;  // equal ones hold a number fixed
};

// The value at x; with a gradient, sets it too.
using SmoothCost = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd* gradient)>;

// From the best of the middles of a grid of eight cells a number by Ceres' BFGS, over arguments
// that a logistic map keeps within the bounds. Not finite costs count as worse than any. Throws
// Cancelled if stopped.
Eigen::VectorXd FindMinimum(const SearchRange& bounds, const SmoothCost& cost,
                            const RunContext& run);

// Where a number of the minimum stands: free, or at an end of its range that holds it back.
enum class RangeEnd { kNone, kLow, kHigh };
// x: what FindMinimum found. A number that is held fixed is at no end.
RangeEnd EndOfRange(const SearchRange& bounds, const SmoothCost& cost, const Eigen::VectorXd& x,
                    Eigen::Index number);

}  // namespace semblance
