// SPDX-License-Identifier: GPL-3.0-or-later
// The fit by the auto plan alone, without further terms or moves of points.
#pragma once

#include "fitting/nested/nested_points.h"
#include "fitting/plan/fit_options.h"
#include "fitting/plan/fit_result.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/base/run_context.h"

namespace semblance::fitting {

// Returns whether the options need nothing else: plan auto with the solver `fastest`.
bool IsAlone(const FitOptions& options);

// Fits and measures only the final surface. Throws as FitNested does. The second overload frees the
// positions and weights as soon as it knows the displacements of the points, and moves their (u,v)
// into the result.
FitResult FitAlone(const HSplineSurface& start, const ScatteredPoints& points, const AutoPlan& plan,
                   const RunContext& context);
FitResult FitAlone(const HSplineSurface& start, OwnedPoints points, const AutoPlan& plan,
                   const RunContext& context);

}  // namespace semblance::fitting
