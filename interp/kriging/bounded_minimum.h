// SPDX-License-Identifier: GPL-3.0-or-later
// Minimises a smooth cost of a few numbers within bounds.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "surfaces/base/run_context.h"

namespace semblance::interp {

struct SearchRange {
  Eigen::VectorXd low, high;  // equal bounds fix a number
};

// Returns the cost at x, and its gradient if `gradient` is not null.
using SmoothCost = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd* gradient)>;

// Starts at the best center of a grid with eight cells per number, and descends by Ceres' BFGS. A
// logistic map of the arguments keeps the numbers within the bounds. Costs that are not finite
// count as worse than all others. Throws Cancelled if stopped.
Eigen::VectorXd FindMinimum(const SearchRange& bounds, const SmoothCost& cost,
                            const RunContext& run);

// The end of its range at which a number of the minimum is held, or kNone.
enum class RangeEnd { kNone, kLow, kHigh };
// x: the result of FindMinimum. A fixed number gives kNone.
RangeEnd EndOfRange(const SearchRange& bounds, const SmoothCost& cost, const Eigen::VectorXd& x,
                    Eigen::Index number);

}  // namespace semblance::interp
