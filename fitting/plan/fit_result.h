// SPDX-License-Identifier: GPL-3.0-or-later
// The result of a fit.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fitting/nested/nested_fit.h"
#include "fitting/relaxation/relaxation.h"
#include "fitting/solve/level_summary.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

struct FitResult {
  HSplineSurface surface;
  std::vector<LevelSummary> levels = {};            // per step of the schedule, or round
  std::vector<RelaxationSummary> relaxations = {};  // per step, or none without relaxation
  std::vector<Vec2> uv = {};                        // per point of the target, after relaxation
  std::vector<double> residual_mm = {};  // per point of the target: distance of the final surface
                                         // at its (u,v)
  double point_rms_mm = kNaN;            // of all points, weighted, after features were restored
  double dowel_rms_mm = kNaN;            // of the points that are no seeds (seeding.h), weighted
  int restored_features = -1;            // offsets that got their template's value back, or kept it
  std::optional<AutoReport> automatic = {};  // assumptions of the auto plan
  bool usable = false;                       // whether every step has a solution
};

// Returns the reasons why the result cannot be used, one line each; empty if it can be used.
std::vector<std::string> FaultsIn(const FitResult& fit);

}  // namespace semblance::fitting
