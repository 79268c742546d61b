// SPDX-License-Identifier: GPL-3.0-or-later
// The ways to minimise a level's terms.
#pragma once

#include <span>
#include <string>

#include "fitting/least_squares/normal_equations.h"
#include "fitting/level/level_fit.h"

namespace semblance {

struct SolverOutcome {
  int iterations = 0;
  int free_vertices = 0;  // that some term touches
  std::string termination = "nothing to solve";
  bool usable = true;        // else the net is as it was
  SparseMatrix points = {};  // lower normal matrix of the points, times some factor; by
                             // SolveDirectly if they are among the terms, else 0 x 0
};

// Whether SolveDirectly can: every term with a weight is separable (term_cost.h).
bool AllSeparable(std::span<const Term> terms);

// Any terms: Ceres, one problem with a block of 3 doubles a vertex, sparse Cholesky, one thread.
SolverOutcome SolveByCeres(const LevelView& view, std::span<const Term> terms, ControlNet& net);

// Separable terms: Ceres, one problem a coordinate with a block of 3 x 3 vertices of the net each,
// the rows of each patch reduced to at most sixteen. The same minimiser, many times faster.
SolverOutcome SolveBlocked(const LevelView& view, std::span<const Term> terms, ControlNet& net);

// Separable terms: the same iteration with one Cholesky factor of the scalar normal equations for
// all coordinates and steps. The same minimiser, many times faster, and in memory that does not
// grow with the points.
SolverOutcome SolveDirectly(const LevelView& view, std::span<const Term> terms, ControlNet& net);

}  // namespace semblance
