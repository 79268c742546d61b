// SPDX-License-Identifier: GPL-3.0-or-later
// Ceres on a view, of a level alone or of all levels at once: the sum of its terms at its minimum.
#pragma once

#include <span>
#include <string>

#include "fitting/terms/level_view.h"
#include "fitting/terms/term.h"

namespace semblance {

struct SolverOutcome {
  int iterations = 0;
  int free_vertices = 0;  // that some term touches
  std::string termination = "nothing to solve";
  bool usable = true;  // else the net is as it was
};

// Any terms: one problem with a block of 3 doubles per vertex, sparse Cholesky, one thread.
SolverOutcome SolveByCeres(const LevelView& view, std::span<const Term> terms, ControlNet& net);

// Separable terms: one problem per coordinate, whose blocks are tiles of 3 x 3 vertices, which
// sparse Cholesky likes far better than single ones; the rows of each patch are reduced to at most
// sixteen. The minimiser of SolveByCeres, many times faster.
SolverOutcome SolveBlocked(const LevelView& view, std::span<const Term> terms, ControlNet& net);

// What solves of a level add to the diagonal of the normal equations of so many vertices. A
// multiple of the identity makes them proximal-point steps, which go to the least-squares solution
// nearest to the start.
double ProximalShift(std::span<const Term> terms, std::size_t vertices);

}  // namespace semblance
