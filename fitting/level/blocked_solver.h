// SPDX-License-Identifier: GPL-3.0-or-later
// Ceres on separable terms: its parameter blocks are tiles of 3 x 3 control vertices, one
// coordinate each, which its sparse Cholesky likes far better than single vertices.
#pragma once

#include <span>

#include "fitting/level/level_solver.h"

namespace semblance {

// Separable terms: one problem per coordinate, the rows of each patch reduced to at most sixteen.
// The minimiser of SolveByCeres, many times faster.
SolverOutcome SolveBlocked(const LevelView& view, std::span<const Term> terms, ControlNet& net);

}  // namespace semblance
