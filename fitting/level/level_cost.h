// SPDX-License-Identifier: GPL-3.0-or-later
// What the ways to solve a level with Ceres share.
#pragma once

#include <ceres/solver.h>

#include <span>
#include <string>

#include "fitting/terms/term_cost.h"

namespace semblance {

// Of a level of so many vertices: damped by a multiple of the identity (level_fit.h), one thread.
ceres::Solver::Options CeresOptions(std::span<const Term> terms, std::size_t vertices);
std::string TerminationName(ceres::TerminationType type);  // lower case
// The rows of all separable terms with a weight.
void AddAllRows(const LevelView& view, std::span<const Term> terms, RowSink& sink);

}  // namespace semblance
