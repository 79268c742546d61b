// SPDX-License-Identifier: GPL-3.0-or-later
// The fit of an H-spline template to points, level by level (thesis 4.2, 4.3).
#pragma once

#include <span>

#include "fitting/plan/fit_options.h"
#include "fitting/plan/fit_result.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Goes by the plan. Level by level, Net(level) is solved for as a plain B-spline (FitLevel) and
// each vertex goes c + fraction (c' - c) of the way: exactly the offsets of scheduled levels change
// (and the vertices of level 0, if scheduled), and finer detail rides along. The adaptive plan
// solves for level 0 and all edited vertices of finer levels at once, until no patch needs finer
// ones. After each solve the points' (u,v) may move (relaxation.h).
//   start: the placed template, or a surface that is already partly fitted.
//   rest: the placed template, from which displacement is measured and whose offsets features get
//     back; same shape as start. The first overload takes start for it. With it a caller can fit
//     part of a schedule, seed dowels anew on the result (seeding.h) and go on.
//   features: vertices of levels >= 1 to protect; may be empty.
// Throws InputError for a target without points or as CheckTarget does, for what FaultsOf finds
// (fit_check.h), a feature of level 0, or a template without extent; Cancelled between solves if
// asked to stop.
FitResult Fit(const HSplineSurface& start, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context);
FitResult Fit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context);
// Scattered points alone. By the auto plan with the solver `fastest` no copy of them is made.
FitResult Fit(const HSplineSurface& start, const ScatteredPoints& points, const FitOptions& options,
              const RunContext& context);

}  // namespace semblance
