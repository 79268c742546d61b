// SPDX-License-Identifier: GPL-3.0-or-later
// Scattered points moved to the feet of their perpendiculars on a coarse surface, before they are
// fitted: (u,v) that are only about right cost vertices, and blur what they are spent on.
#pragma once

#include <span>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_shape.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// What the moves did. Distances are those from the coarse surface, root mean squares over the
// points that are outliers neither of the first nor of the last.
struct FootMoves {
  int rounds = -1;              // that were kept; 0: the (u,v) are as they were
  double rms_before_mm = kNaN;  // from the surface over the first (u,v)
  double rms_after_mm = kNaN;   // from that over the last: at most as much
  double rms_move_mm = kNaN;    // on the last surface, from the first (u,v) to the last
  double max_move_mm = kNaN;
  int folds_prevented = 0;  // triangles that these moves would have turned over
};

struct MovedUv {
  std::vector<Vec2> uv;  // one per point, in [0,1] x [0,1]
  FootMoves moves;
};

// In up to plan.relaxation_rounds rounds: a nested fit of all but the finer levels, and each point
// that is no outlier of it moved to the foot of its perpendicular. The rounds end where moves are a
// tenth of the distances, or where a round does not bring the points nearer; that round is taken
// back.
//   shape: without finer levels; triangles: between the points, or none. Of those that most run
//     with no move turns one over.
// Throws InputError as CheckPoints and FitNested do; Cancelled. The same bytes for any number of
// threads.
MovedUv MoveToFeet(const HSplineShape& shape, const ScatteredPoints& points,
                   std::span<const Triangle> triangles, const AutoPlan& plan,
                   const RunContext& context);

// Halves moves until no triangle turns over that ran on the map as most do; at the latest where
// there is no move left. Along closed directions the shorter way counts. Returns how many triangles
// would have turned over.
int KeepFromFolding(const HSplineShape& shape, std::span<const Triangle> triangles,
                    std::span<const Vec2> from, std::span<Vec2> to);

}  // namespace semblance
