// SPDX-License-Identifier: GPL-3.0-or-later
// A fit whose edges continue other surfaces.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fitting/plan/fit_options.h"
#include "fitting/plan/fit_result.h"
#include "fitting/problem/fit_target.h"
#include "problems/points/join_report.h"
#include "problems/points/surface_join.h"
#include "surfaces/base/run_context.h"

namespace semblance {

struct JoinedFit {
  FitResult fit;
  std::vector<JoinReport> joins;
};

// What a fit must be for joins: empty, or what to write instead.
std::string JoinPlanFault(const FitOptions& options);

// A fit without the joins shows how fine the new edges become. Then they are held (join_places.h),
// and again at more places, over finer vertices, where the result does not hold between them: at
// most six times. Throws as Fit and ExactPointsOf do, and InputError for corners at which two
// joins contradict each other, points beside an edge that lie plainly nearer to another one of the
// given surface, or to the given one run the other way, and more than kMostExactPoints places.
//   start: of level 0 alone, or of the plan's levels. target: at least one point.
JoinedFit FitJoined(const HSplineSurface& start, FitTarget target,
                    std::span<const OpenedJoin> joins, const FitOptions& options,
                    const RunContext& context);

}  // namespace semblance
