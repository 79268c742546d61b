// SPDX-License-Identifier: GPL-3.0-or-later
// Solvers that minimise the sum of the terms of a view, either of a single level or of all levels.
#pragma once

#include <span>
#include <string>

#include "fitting/terms/level_view.h"
#include "fitting/terms/term.h"

namespace semblance::fitting {

struct SolverOutcome {
  int iterations = 0;
  int free_vertices = 0;  // vertices with an effect on some term
  std::string termination = "nothing to solve";
  bool usable = true;  // false: the solver failed and the net is unchanged
};

// Solves for any terms by one ceres::Problem with a parameter block of 3 doubles per vertex, sparse
// Cholesky and one thread.
SolverOutcome SolveByCeres(const LevelView& view, std::span<const Term> terms, ControlNet& net);

// Solves for separable terms by one ceres::Problem per coordinate. The parameter blocks are tiles
// of 3 x 3 vertices, which sparse Cholesky handles much faster than single vertices, and the rows
// of each patch are compressed to at most sixteen. The minimiser is that of SolveByCeres.
SolverOutcome SolveBlocked(const LevelView& view, std::span<const Term> terms, ControlNet& net);

// The multiple of the identity that solves of a single level add to the normal equations. It turns
// them into proximal-point steps, which converge to the least-squares solution nearest to the
// start.
double ProximalShift(std::span<const Term> terms, std::size_t vertices);

// Solves for linear terms (AllLinear), which may couple x, y and z, by one sparse Cholesky factor
// over all coordinates. It takes steps with this factor until they are as short as round-off. The
// minimiser is that of SolveByCeres, which makes a factor in each step.
SolverOutcome SolveCoupled(const LevelView& view, std::span<const Term> terms, ControlNet& net);

}  // namespace semblance::fitting
