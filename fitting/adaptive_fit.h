// SPDX-License-Identifier: GPL-3.0-or-later
// The fit of all levels at once, with finer vertices where they are needed (AdaptivePlan).
#pragma once

#include "fitting/fit.h"

namespace semblance {

// As Fit (fit.h) with an AdaptivePlan, but for the features. Its solver is always one CHOLMOD
// factor of the normal equations of all unknowns, shifted and iterated as FitLevel's; a robust loss
// by iterative reweighting. Memory and time are linear in the points. Throws InputError for terms
// other than points, smoothness and membrane.
FitResult FitAdaptively(const HSplineSurface& start, const HSplineSurface& rest,
                        const FitTarget& target, const FitOptions& options,
                        const RunContext& context);

}  // namespace semblance
