// SPDX-License-Identifier: GPL-3.0-or-later
// Fit(): fits an H-spline surface to points, level by level (thesis 4.2, 4.3).
#pragma once

#include <span>

#include "fitting/plan/fit_options.h"
#include "fitting/plan/fit_result.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// Runs the steps of the plan. A plan that fits level by level solves for Net(level) as a plain
// B-spline (FitLevel), and moves each vertex c to c + fraction (c' - c). Only the offsets of
// scheduled levels change (and the vertices of level 0, if it is scheduled); finer detail moves
// with the coarser levels. The adaptive plan solves for level 0 and all edited vertices of finer
// levels at once, until no patch needs finer ones. The auto plan chooses everything from the points
// (nested_fit.h). After each solve the points' (u,v) may move (relaxation.h).
//   start: the placed template, or a partly fitted surface.
//   rest: the placed template, of the same shape. Displacements are measured from it, and features
//     get back its offsets. The first overload uses start. With `rest`, a caller can fit part of a
//     schedule, seed dowels on the result (seeding.h) and continue.
//   features: vertices of levels >= 1 to protect; may be empty.
// Throws InputError for a target without points or as CheckTarget does, for options that
// FindFitFaults refuses (fit_check.h), for a feature of level 0, and for a template without extent;
// Cancelled between solves.
FitResult Fit(const HSplineSurface& start, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context);
FitResult Fit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context);
// Fits to scattered points alone. The auto plan with the solver `fastest` makes no further copy of
// them.
FitResult Fit(const HSplineSurface& start, const ScatteredPoints& points, const FitOptions& options,
              const RunContext& context);

}  // namespace semblance::fitting
