// SPDX-License-Identifier: GPL-3.0-or-later
// The least-squares fit of one level of an H-spline, seen as a plain B-spline.
#pragma once

#include <span>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/solve/level_summary.h"
#include "fitting/terms/level_view.h"
#include "fitting/terms/term.h"
#include "surfaces/hspline/bspline.h"

namespace semblance {

// counts: of the observations, one per patch.
PatchCoverage CoverageOf(const std::vector<int>& counts);

struct LevelSolution {
  ControlNet net;
  LevelSummary summary;
};

// Minimises the sum of the terms over the level's control vertices: by Ceres, one thread (a
// parameter block is a vertex, or, if all terms are linear and treat x, y and z alike, one
// coordinate of 3 x 3 vertices); or, if the fastest way is asked for and all terms are linear, with
// one sparse Cholesky factor, for all three coordinates at once where a term couples them. A loss
// makes either a sequence of such solves (space_solve.h) unless another term couples x, y and z;
// the fastest way then goes by Ceres, as it does with a term that is not linear. Where the terms
// leave vertices undetermined, the solution nearest to view.start is taken (thesis 4.2 has no word
// on it; the steps are damped by a multiple of the identity, a proximal-point iteration, which
// converges to it). Observations are used in a canonical order, so their order has no effect.
// Without a report the summary has no terms, no coverage and no rank. Throws InputError if nothing
// can be solved: sizes that disagree, a template without extent for a term that needs it, or points
// without a foot on bone for one that looks at bone.
LevelSolution FitLevel(LevelView view, std::span<const Term> terms, Solver solver = Solver::kCeres,
                       SolveReport report = SolveReport::kFull);

}  // namespace semblance
