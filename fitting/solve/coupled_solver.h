// SPDX-License-Identifier: GPL-3.0-or-later
// Linear terms that couple x, y and z, by one factor.
#pragma once

#include <span>

#include "fitting/solve/ceres_solver.h"

namespace semblance {

// Terms that are linear (AllLinear): one sparse Cholesky factor over all coordinates, and steps by
// it until they are no longer than rounding. The minimiser of SolveByCeres, which makes a factor in
// each step.
SolverOutcome SolveCoupled(const LevelView& view, std::span<const Term> terms, ControlNet& net);

}  // namespace semblance
