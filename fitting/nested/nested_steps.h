// SPDX-License-Identifier: GPL-3.0-or-later
// FitNested (nested_fit.h) in steps, between which the points as given may be freed.
#pragma once

#include "fitting/nested/nested_fit.h"
#include "fitting/nested/nested_points.h"

namespace semblance {

// Throws InputError as FitNested does.
void CheckNested(const HSplineSurface& start, const ScatteredPoints& points);

// points: by DisplacementsFrom or TakeDisplacements, of points that CheckNested lets pass.
NestedFitResult FitNested(const HSplineSurface& start, NestedPoints points, const AutoPlan& plan,
                          const RunContext& context);

}  // namespace semblance
