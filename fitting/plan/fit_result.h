// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit gives back.
#pragma once

#include <optional>
#include <vector>

#include "fitting/nested/nested_fit.h"
#include "fitting/relaxation/relaxation.h"
#include "fitting/solve/level_summary.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct FitResult {
  HSplineSurface surface;
  std::vector<LevelSummary> levels = {};            // per step of the schedule, or round
  std::vector<RelaxationSummary> relaxations = {};  // per step, or none without relaxation
  std::vector<Vec2> uv = {};             // per point of the target: where relaxation has left it
  std::vector<double> residual_mm = {};  // per point of the target, in its order: distance of the
                                         // final surface at its (u,v)
  double point_rms_mm = kNaN;            // of all points, weighted, after features were restored
  double dowel_rms_mm = kNaN;            // of the points that were not seeded (seeding.h), weighted
  int restored_features = -1;            // offsets that were given back, or never changed
  std::optional<AutoReport> automatic = {};  // of the auto plan: what it assumed
  bool usable = false;                       // every step's solution could be used
};

}  // namespace semblance
