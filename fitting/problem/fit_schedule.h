// SPDX-License-Identifier: GPL-3.0-or-later
// Plans: the order in which the levels of an H-spline are fitted, and the fraction of each solve
// that is kept. Each plan owns its options.
#pragma once

#include <array>
#include <string_view>
#include <variant>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_shape.h"

namespace semblance::fitting {

// One step of the fit (thesis 4.2): a level is fitted by least squares, and every control vertex c
// moves the given fraction of the way to its solution c', to c + fraction (c' - c).
struct ScheduleStep {
  int level = 0;
  double fraction = 1;
};
template <class Visitor>
void Fields(Visitor& visit, ScheduleStep& o) {
  visit(FieldInfo{.name = "level",
                  .min = 0,
                  .max = 12,
                  .doc = "level of the H-spline to fit; 0 is the coarsest"},
        o.level);
  visit(FieldInfo{.name = "fraction",
                  .min = 0,
                  .max = 1,
                  .doc =
                      "part of the way from the old to the solved vertices; less is more cautious"},
        o.fraction);
}

// The schedule of thesis 4.4. It reduces a misfit that every level can remove to the product of all
// 1 - fraction, 8 %.
inline std::vector<ScheduleStep> PublishedSchedule() {
  return {{0, 0.4}, {1, 0.35}, {2, 0.35}, {0, 0.35}, {1, 0.3}, {2, 0.3}};
}

enum class FitAim { kSurface, kLevel };
constexpr auto EnumNames(FitAim) { return std::to_array<std::string_view>({"surface", "level"}); }

template <class Visitor>
void ScheduleField(Visitor& visit, std::vector<ScheduleStep>& schedule) {
  visit(FieldInfo{.name = "schedule",
                  .min = 1,
                  .doc = "levels in the order of the fit, each with the fraction of its solution "
                         "to keep (thesis 4.4)"},
        schedule);
}

// The options of every plan that fits level by level.
template <class Visitor>
void LevelwiseFields(Visitor& visit, int& sweeps, FitAim& aim) {
  visit(FieldInfo{.name = "sweeps",
                  .min = 0,
                  .max = 100,
                  .doc = "number of final passes (back-fitting) over all fitted levels, coarse to "
                         "fine, at fraction 1"},
        sweeps);
  visit(
      FieldInfo{.name = "aim",
                .doc = "surface: a level moves so that the whole surface, with the present detail "
                       "of finer levels, meets the points; level: so that the level alone meets "
                       "them (a possible reading of the thesis), which lets detail overshoot"},
      aim);
}

// Runs the steps of the schedule once.
struct ListedPlan {
  static constexpr std::string_view kName = "listed";
  std::vector<ScheduleStep> schedule = PublishedSchedule();
  int sweeps = 0;
  FitAim aim = FitAim::kSurface;
};
template <class Visitor>
void Fields(Visitor& visit, ListedPlan& o) {
  ScheduleField(visit, o.schedule);
  LevelwiseFields(visit, o.sweeps, o.aim);
}

// Fits levels 0, 1, .. finest in this order.
struct CoarseToFinePlan {
  static constexpr std::string_view kName = "coarse_to_fine";
  int finest = 2;
  double fraction = 1;
  int sweeps = 0;
  FitAim aim = FitAim::kSurface;
};
template <class Visitor>
void Fields(Visitor& visit, CoarseToFinePlan& o) {
  visit(FieldInfo{.name = "finest", .min = 0, .max = 12, .doc = "last level to fit"}, o.finest);
  visit(FieldInfo{.name = "fraction",
                  .min = 0,
                  .max = 1,
                  .doc = "fraction of the way that each level moves to its solution"},
        o.fraction);
  LevelwiseFields(visit, o.sweeps, o.aim);
}

// Repeats the steps of the schedule while the points' root mean square distance falls.
struct UntilPlan {
  static constexpr std::string_view kName = "until";
  std::vector<ScheduleStep> schedule = PublishedSchedule();
  double tolerance_mm = 0.01;
  int max_passes = 20;
  int sweeps = 0;
  FitAim aim = FitAim::kSurface;
};
template <class Visitor>
void Fields(Visitor& visit, UntilPlan& o) {
  ScheduleField(visit, o.schedule);
  visit(FieldInfo{.name = "tolerance_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "the fit ends after a pass over the schedule that lowers the points' root "
                         "mean square distance by no more than this"},
        o.tolerance_mm);
  visit(
      FieldInfo{
          .name = "max_passes", .min = 1, .max = 1000, .doc = "most passes over the schedule"},
      o.max_passes);
  LevelwiseFields(visit, o.sweeps, o.aim);
}

// A rectangle of the domain with its own tolerance.
struct ToleranceRegion {
  std::array<double, 2> u = {0, 1};
  std::array<double, 2> v = {0, 1};
  double tolerance_mm = 0.5;

  bool Holds(double at_u, double at_v) const {
    return at_u >= u[0] && at_u <= u[1] && at_v >= v[0] && at_v <= v[1];
  }
};
template <class Visitor>
void Fields(Visitor& visit, ToleranceRegion& o) {
  visit(FieldInfo{.name = "u", .min = 0, .max = 1, .doc = "first and last u of the region"}, o.u);
  visit(FieldInfo{.name = "v", .min = 0, .max = 1, .doc = "first and last v of the region"}, o.v);
  visit(FieldInfo{.name = "tolerance_mm",
                  .unit = "mm",
                  .min = 1e-9,
                  .max = 1e3,
                  .doc = "replaces the plan's tolerance_mm for points in this region"},
        o.tolerance_mm);
}

// Solves for all levels at once, and adds finer vertices only where they are needed. The unknowns
// of one linear least-squares problem are the vertices of level 0 and the edited vertices of finer
// levels. After a solve, each patch with a point farther away than the tolerance gets vertices of
// the next finer level; this repeats until no patch needs any.
struct AdaptivePlan {
  static constexpr std::string_view kName = "adaptive";
  double tolerance_mm = 0.5;
  std::vector<ToleranceRegion> regions = {};
  int finest = 4;
  int margin = 0;
  int min_points = 9;

  // The tolerance of a point at (u,v): that of the last region that holds it, or else the plan's.
  double ToleranceAt(double u, double v) const {
    double tolerance = tolerance_mm;
    for (const ToleranceRegion& region : regions) {
      tolerance = region.Holds(u, v) ? region.tolerance_mm : tolerance;
    }
    return tolerance;
  }
};
template <class Visitor>
void Fields(Visitor& visit, AdaptivePlan& o) {
  visit(FieldInfo{.name = "tolerance_mm",
                  .unit = "mm",
                  .min = 1e-9,
                  .max = 1e3,
                  .doc = "a patch with a point farther from the surface than this gets finer "
                         "vertices; give at least about five times the points' noise"},
        o.tolerance_mm);
  visit(FieldInfo{.name = "regions",
                  .doc = "regions of the domain with their own tolerances, such as [{u: [0.4, "
                         "0.6], v: [0.3, 0.5], tolerance_mm: 0.1}]; if several regions hold a "
                         "point, the last one applies"},
        o.regions);
  visit(FieldInfo{.name = "finest",
                  .min = 0,
                  .max = 8,
                  .doc = "finest level that may get vertices; at most that of the surface"},
        o.finest);
  visit(FieldInfo{.name = "margin",
                  .min = 0,
                  .max = 8,
                  .doc = "additional rings of finer vertices around a refined patch"},
        o.margin);
  visit(
      FieldInfo{.name = "min_points",
                .min = 1,
                .max = 1e6,
                .doc = "a patch with fewer points is not refined, so that single outliers have no "
                       "effect"},
      o.min_points);
}

enum class OutlierRule { kDrop, kKeep };
constexpr auto EnumNames(OutlierRule) { return std::to_array<std::string_view>({"drop", "keep"}); }

// Chooses the resolution, the smoothness and the outliers from the points alone (fitting/nested/).
// Its terms are `points` and `smoothness` with `weight: auto`.
struct AutoPlan {
  static constexpr std::string_view kName = "auto";
  int finest = 7;
  OutlierRule outliers = OutlierRule::kDrop;
  int relaxation_rounds = 0;
  bool stretched = true;
};
template <class Visitor>
void Fields(Visitor& visit, AutoPlan& o) {
  visit(FieldInfo{.name = "finest",
                  .min = 0,
                  .max = 8,
                  .doc = "finest level that may get vertices, for any density of points"},
        o.finest);
  visit(FieldInfo{.name = "outliers",
                  .doc = "drop: points that disagree with all of their neighbours get weight 0 and "
                         "are listed; keep: every point is used"},
        o.outliers);
  visit(
      FieldInfo{.name = "relaxation_rounds",
                .min = 0,
                .max = 20,
                .doc = "most rounds, before the fit, in which each point's (u,v) move to the foot "
                       "of its perpendicular on a coarse surface; for approximate (u,v); 0: (u,v) "
                       "stay. For `semblance fit` without exact points"},
      o.relaxation_rounds);
  visit(FieldInfo{.name = "stretched",
                  .doc = "true: if the surface bends clearly less along one direction, such as a "
                         "ridge along its crest, bending may cost more along it and less across it "
                         "(smoothness.stretch), if that predicts better; false: the same cost in "
                         "every direction"},
        o.stretched);
}

// The solver that finds the minimum of the terms. Both find the same minimum.
enum class Solver {
  kCeres,   // ceres::Problem; control vertices are parameter blocks
  kFastest  // direct factorisation if the terms allow it, else Ceres
};
constexpr auto EnumNames(Solver) { return std::to_array<std::string_view>({"ceres", "fastest"}); }

using SchedulePlan = std::variant<ListedPlan, CoarseToFinePlan, UntilPlan, AdaptivePlan, AutoPlan>;

// The steps of one pass of a plan that fits level by level; empty for the plans adaptive and auto.
std::vector<ScheduleStep> PlanSteps(const SchedulePlan& plan);
// The aim of a plan's levels; kSurface for the plans adaptive and auto.
FitAim PlanAim(const SchedulePlan& plan);
// The finest level that a plan names; 0 for the auto plan, which uses as many levels as it needs.
int FinestPlanLevel(const SchedulePlan& plan);
// The finest level that the plan may give a surface of this shape. The auto plan's `finest` is
// lowered until the level has at most kMaxPatches patches along each side.
int FinestAllowed(const SchedulePlan& plan, const HSplineShape& shape);

}  // namespace semblance::fitting
