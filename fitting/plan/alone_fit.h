// SPDX-License-Identifier: GPL-3.0-or-later
// The auto plan without any other term: nothing is to be driven between its solves.
#pragma once

#include "fitting/nested/nested_points.h"
#include "fitting/plan/fit_options.h"
#include "fitting/plan/fit_result.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/base/run_context.h"

namespace semblance {

// Whether options ask for it.
bool IsAlone(const FitOptions& options);

// Only the surface as it ends is measured. Throw as FitNested does. Of points that it owns the
// positions and weights are freed as soon as their displacements are known, and the result gets the
// (u,v).
FitResult FitAlone(const HSplineSurface& start, const ScatteredPoints& points, const AutoPlan& plan,
                   const RunContext& context);
FitResult FitAlone(const HSplineSurface& start, OwnedPoints points, const AutoPlan& plan,
                   const RunContext& context);

}  // namespace semblance
