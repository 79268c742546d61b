// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit can be asked for.
#pragma once

#include <span>
#include <vector>

#include "fitting/fit.h"

namespace semblance {

// Throws InputError as Fit does (fit.h).
void CheckFit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options);

// The steps of the plan, if it goes level by level: of one pass.
std::vector<ScheduleStep> StepsOf(const FitOptions& options);

}  // namespace semblance
