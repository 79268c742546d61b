// SPDX-License-Identifier: GPL-3.0-or-later
// Robust losses as least squares with weights that follow the misfits (iteratively reweighted least
// squares), so that the points of a patch can be reduced as without a loss.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "fitting/level/level_solver.h"

namespace semblance {

// What the squared misfit of each observation is multiplied by in the cost of the terms `points`
// (and `tangent_points`, as if along all axes), at `net`: the sum over them of
// weight * rho'(|d|^2) * w / sum of w.
std::vector<double> CostWeights(const LevelView& view, std::span<const Term> terms,
                                const ControlNet& net);

using SeparableSolver = std::function<SolverOutcome(const LevelView& view,
                                                    std::span<const Term> terms, ControlNet& net)>;

// Separable terms, some with a loss: `solve` again and again, each time with the weights of the
// surface as it stands, the points of a patch reduced anew, until the surface stands still. As
// rho(s) is concave for each loss, the cost falls with every step (majorisation; Hunter & Lange
// 2004). The reference is SolveByCeres, which looks at each point by itself.
// least_move: of the norm of all vertices; a step that moves them no more is the last.
SolverOutcome SolveReweighted(const LevelView& view, std::span<const Term> terms,
                              const SeparableSolver& solve, ControlNet& net,
                              double least_move = 1e-12);

// By what fits the terms, to the minimum: SolveByCeres where they couple x, y and z, else
// SolveDirectly if the fastest way is asked for, else SolveBlocked; a loss by reweighting.
SolverOutcome Minimise(const LevelView& view, std::span<const Term> terms, LevelSolver solver,
                       ControlNet& net, double least_move = 1e-12);

}  // namespace semblance
