// SPDX-License-Identifier: GPL-3.0-or-later
// What the ways to solve with Ceres share.
#pragma once

#include <ceres/solver.h>

#include <span>
#include <string>

#include "fitting/terms/term.h"

namespace semblance {

// Damped by a multiple of the identity (level_fit.h), for so many vertices; one thread.
ceres::Solver::Options CeresOptions(std::span<const Term> terms, std::size_t vertices);
std::string TerminationName(ceres::TerminationType type);  // lower case

}  // namespace semblance
