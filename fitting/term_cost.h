// SPDX-License-Identifier: GPL-3.0-or-later
// Each term twice: as residuals for Ceres, and as the plain sum that its documentation states.
#pragma once

#include <ceres/problem.h>

#include <vector>

#include "fitting/level_fit.h"
#include "fitting/term.h"

namespace semblance {

// Adds the residuals of a term over `net`, whose vertices become parameter blocks of 3 doubles. The
// sum of their squares (robust: of their losses), which is twice Ceres' cost, equals TermCost.
void AddResiduals(const PointTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);
void AddResiduals(const PriorTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);
void AddResiduals(const SmoothnessTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);
void AddResiduals(const MembraneTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);

// The cost of a term as term.h states it, mm^2.
double TermCost(const PointTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const PriorTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const SmoothnessTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const MembraneTerm& term, const LevelView& view, const ControlNet& net);

}  // namespace semblance
