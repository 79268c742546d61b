// SPDX-License-Identifier: GPL-3.0-or-later
// FitNested (nested_fit.h) in steps, between which the points as given may be freed.
#pragma once

#include <span>

#include "fitting/nested/nested_fit.h"
#include "fitting/nested/nested_points.h"

namespace semblance {

// Throws InputError as FitNested does.
void CheckNested(const HSplineSurface& start, const ScatteredPoints& points);

// points: by DisplacementsFrom or TakeDisplacements, of points that CheckNested lets pass.
NestedFitResult FitNested(const HSplineSurface& start, NestedPoints points, const AutoPlan& plan,
                          const RunContext& context);

// What the report says of the surface that was found becomes what is true of another one, which
// other terms or exact points have made of it: noise and correlation of neighbours; and where it is
// plainly farther from the points, nothing of points held out, of density and of rounding.
//   residual_mm: of the surface that was found.
void TellOf(const HSplineSurface& surface, const ScatteredPoints& points,
            std::span<const double> residual_mm, int threads, AutoReport& report);

}  // namespace semblance
