// SPDX-License-Identifier: GPL-3.0-or-later
// Why a fit's result cannot be used.
#pragma once

#include <string>
#include <vector>

#include "fitting/plan/fit_result.h"

namespace semblance {

// One line each; empty if it can be used.
std::vector<std::string> FaultsIn(const FitResult& fit);

}  // namespace semblance
