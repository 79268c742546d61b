// SPDX-License-Identifier: GPL-3.0-or-later
// The fit of an H-spline template to points, level by level (thesis 4.2, 4.3).
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "fitting/level/level_fit.h"
#include "fitting/problem/feature_rule.h"
#include "fitting/problem/fit_schedule.h"
#include "fitting/problem/fit_target.h"
#include "fitting/relaxation/relaxation.h"
#include "fitting/terms/term.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

enum class FitAim { kSurface, kLevel };
constexpr auto EnumNames(FitAim) { return std::to_array<std::string_view>({"surface", "level"}); }

struct FitOptions {
  std::vector<ScheduleStep> schedule = PublishedSchedule();
  std::vector<Term> terms = {PointTerm{}, SmoothnessTerm{}, MembraneTerm{}};
  FeatureRule features = RestoreFeatures{};
  FitAim aim = FitAim::kSurface;
  Relaxation relaxation = NoRelaxation{};
  SchedulePlan plan = ListedPlan{};
  int sweeps = 0;
  LevelSolver solver = LevelSolver::kCeres;
};
template <class Visitor>
void Fields(Visitor& visit, FitOptions& o) {
  visit(FieldInfo{.name = "schedule",
                  .min = 1,
                  .doc = "levels in the order in which they are fitted, each with the fraction of "
                         "its solution to take (thesis 4.4)"},
        o.schedule);
  visit(FieldInfo{.name = "terms", .min = 1, .doc = "what each level's solve weighs"}, o.terms);
  visit(FieldInfo{.name = "features",
                  .doc = "what the fit may do to the offsets that make eyes, nose and mouth; "
                         "restore: fit them as any, then give them back the template's (thesis "
                         "4.3); free: they keep what the fit gave; weighted: they resist it; "
                         "frozen: they do not take part, and the fit makes do with the others"},
        o.features);
  visit(FieldInfo{.name = "aim",
                  .doc = "surface: a level moves so that the whole surface, with the detail of its "
                         "finer levels as it stands, meets the points; level: so that the level "
                         "alone does, as the thesis may be read, which lets detail overshoot"},
        o.aim);
  visit(
      FieldInfo{.name = "relaxation",
                .doc = "whether and how the points' (u,v) move over the surface; none: they stay; "
                       "footpoint: after each step of the schedule towards the nearest point of "
                       "the surface; alternating: against their neighbours' pull too, and the "
                       "level is fitted again after each round; tangent_distance: alternating, "
                       "then fits in which the points may slide along the surface; joint: each "
                       "round moves (u,v) and vertices in one problem, then fits the level"},
      o.relaxation);
  visit(
      FieldInfo{.name = "plan",
                .doc =
                    "listed: the steps of the schedule once; coarse_to_fine: level by level "
                    "instead; until: the schedule again and again while that helps; adaptive: all "
                    "levels at once, finer vertices only where they are needed"},
      o.plan);
  visit(
      FieldInfo{.name = "sweeps",
                .min = 0,
                .max = 100,
                .doc = "how often all levels that were fitted are fitted again at the end, coarse "
                       "to fine and whole (back-fitting)"},
      o.sweeps);
  visit(
      FieldInfo{.name = "solver",
                .doc = "ceres: one problem a level, its parameter blocks the control vertices, in "
                       "tiles of 3 x 3 where the terms are linear and treat x, y and z alike; "
                       "fastest: one direct factorisation of the same least squares wherever no "
                       "loss and no coupled term forbids it, the same surface to rounding"},
      o.solver);
}

struct FitResult {
  HSplineSurface surface;
  std::vector<LevelSummary> levels = {};            // one a step of the schedule, or a round
  std::vector<RelaxationSummary> relaxations = {};  // one a step, or none without relaxation
  std::vector<Vec2> uv = {};             // one a point of the target: where relaxation has left it
  std::vector<double> residual_mm = {};  // one a point of the target, in its order: distance of
                                         // the final surface at its (u,v)
  double point_rms_mm = kNaN;            // of all points, weighted, after features were restored
  double dowel_rms_mm = kNaN;            // of the points that were not seeded (seeding.h), weighted
  int restored_features = -1;            // offsets that were given back, or never changed
  bool usable = false;                   // every step's solution could be used
};

// Fits the levels of the schedule in turn: Net(level) is solved for as a plain B-spline (FitLevel)
// and each vertex goes c + fraction (c' - c) of the way. Exactly the offsets of scheduled levels
// change (and the vertices of level 0, if scheduled); finer detail rides along. After each step the
// points' (u,v) may move (relaxation.h).
//   start: the placed template, or a surface that is already partly fitted.
//   rest: the placed template, from which displacement is measured and whose offsets features get
//     back; same shape as start. The first overload takes start for it. With it a caller can fit
//     part of a schedule, seed dowels anew on the result (seeding.h) and go on.
//   features: vertices of levels >= 1 to protect; may be empty.
// Throws InputError for a target without points or as CheckTarget does, an empty schedule, a level
// that the surface does not have, a fraction outside [0,1], a feature of level 0, or a template
// without extent; Cancelled between steps if asked to stop.
FitResult Fit(const HSplineSurface& start, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context);
FitResult Fit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context);

}  // namespace semblance
