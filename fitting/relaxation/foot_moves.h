// SPDX-License-Identifier: GPL-3.0-or-later
// Moves the (u,v) of scattered points to the feet of their perpendiculars on a coarse surface,
// before the fit. Inaccurate (u,v) look like detail: they cost vertices and blur the surface.
#pragma once

#include <span>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_shape.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::fitting {

// Statistics of the moves. Root mean squares are over the points that are outliers neither of the
// first nor of the last surface.
struct FootMoves {
  int rounds = -1;              // kept rounds; 0: the (u,v) are unchanged
  double rms_before_mm = kNaN;  // distance from the surface fitted at the first (u,v)
  double rms_after_mm = kNaN;   // distance from the surface fitted at the last (u,v); not larger
  double rms_move_mm = kNaN;    // on the last surface, from the first (u,v) to the last
  double max_move_mm = kNaN;
  int folds_prevented = 0;  // triangles that whole moves would have turned over
};

struct MovedUv {
  std::vector<Vec2> uv;  // one per point, in [0,1] x [0,1]
  FootMoves moves;
};

// Runs up to plan.relaxation_rounds rounds. A round makes a nested fit of the coarse levels, and
// moves each point that is not an outlier of the fit to the foot of its perpendicular. The rounds
// end when the moves are a tenth of the distances, or when a round does not bring the points
// nearer; that round is undone.
//   shape: without finer levels.
//   triangles: triangles between the points, or none. No move turns over a triangle that has the
//   majority's orientation.
// Throws InputError as CheckPoints and FitNested do; Cancelled. The same bytes for any number of
// threads.
MovedUv MoveToFeet(const HSplineShape& shape, const ScatteredPoints& points,
                   std::span<const Triangle> triangles, const AutoPlan& plan,
                   const RunContext& context);

// Halves moves until no triangle turns over that had the majority's orientation at `from`. Moves of
// stubborn triangles are dropped. Along a closed u the shorter way counts. Returns the
// number of triangles that whole moves would turn over.
int KeepFromFolding(const HSplineShape& shape, std::span<const Triangle> triangles,
                    std::span<const Vec2> from, std::span<Vec2> to);

}  // namespace semblance::fitting
