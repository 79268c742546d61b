// SPDX-License-Identifier: GPL-3.0-or-later
// Plans: in which order the levels of an H-spline are fitted, and how much of each solve is kept.
// Each plan owns its options.
#pragma once

#include <array>
#include <string_view>
#include <variant>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_shape.h"

namespace semblance {

// One step of the fit (thesis 4.2): level L is fitted by least squares, and every control vertex
// goes `fraction` of the way to its solution, c + fraction (c' - c).
struct ScheduleStep {
  int level = 0;        // 0 is the coarsest
  double fraction = 1;  // of the way to the solution; less is more cautious
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

// Thesis 4.4. What is left of a misfit that every level could remove is the product of
// 1 - fraction, 8 % here.
inline std::vector<ScheduleStep> PublishedSchedule() {
  return {{0, 0.4}, {1, 0.35}, {2, 0.35}, {0, 0.35}, {1, 0.3}, {2, 0.3}};
}

enum class FitAim { kSurface, kLevel };
constexpr auto EnumNames(FitAim) { return std::to_array<std::string_view>({"surface", "level"}); }

template <class Visitor>
void ScheduleField(Visitor& visit, std::vector<ScheduleStep>& schedule) {
  visit(FieldInfo{.name = "schedule",
                  .min = 1,
                  .doc = "levels in the order in which they are fitted, each with the fraction of "
                         "its solution to take (thesis 4.4)"},
        schedule);
}

// What every plan that goes level by level has.
template <class Visitor>
void LevelwiseFields(Visitor& visit, int& sweeps, FitAim& aim) {
  visit(
      FieldInfo{.name = "sweeps",
                .min = 0,
                .max = 100,
                .doc = "how often all levels that were fitted are fitted again at the end, coarse "
                       "to fine and whole (back-fitting)"},
      sweeps);
  visit(FieldInfo{.name = "aim",
                  .doc = "surface: a level moves so that the whole surface, with the detail of its "
                         "finer levels as it stands, meets the points; level: so that the level "
                         "alone does, as the thesis may be read, which lets detail overshoot"},
        aim);
}

// The steps of the schedule, once.
struct ListedPlan {
  static constexpr std::string_view kName = "listed";
  std::vector<ScheduleStep> schedule = PublishedSchedule();  // in this order
  int sweeps = 0;                                            // over all its levels, at the end
  FitAim aim = FitAim::kSurface;                             // of a level
};
template <class Visitor>
void Fields(Visitor& visit, ListedPlan& o) {
  ScheduleField(visit, o.schedule);
  LevelwiseFields(visit, o.sweeps, o.aim);
}

// Levels 0, 1, .. finest.
struct CoarseToFinePlan {
  static constexpr std::string_view kName = "coarse_to_fine";
  int finest = 2;                 // last level
  double fraction = 1;            // of the way to the solution
  int sweeps = 0;                 // over all levels, at the end
  FitAim aim = FitAim::kSurface;  // of a level
};
template <class Visitor>
void Fields(Visitor& visit, CoarseToFinePlan& o) {
  visit(FieldInfo{.name = "finest", .min = 0, .max = 12, .doc = "last level to fit"}, o.finest);
  visit(FieldInfo{.name = "fraction",
                  .min = 0,
                  .max = 1,
                  .doc = "part of the way that each level goes to its solution"},
        o.fraction);
  LevelwiseFields(visit, o.sweeps, o.aim);
}

// The steps of the schedule again and again, while the points' root mean square distance falls.
struct UntilPlan {
  static constexpr std::string_view kName = "until";
  std::vector<ScheduleStep> schedule = PublishedSchedule();  // of a pass
  double tolerance_mm = 0.01;                                // a pass that gains less is the last
  int max_passes = 20;                                       // at most
  int sweeps = 0;                                            // over all levels, at the end
  FitAim aim = FitAim::kSurface;                             // of a level
};
template <class Visitor>
void Fields(Visitor& visit, UntilPlan& o) {
  ScheduleField(visit, o.schedule);
  visit(FieldInfo{.name = "tolerance_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "a pass over the schedule that lowers the points' root mean square "
                         "distance by no more than this is the last"},
        o.tolerance_mm);
  visit(
      FieldInfo{
          .name = "max_passes", .min = 1, .max = 1000, .doc = "passes over the schedule at most"},
      o.max_passes);
  LevelwiseFields(visit, o.sweeps, o.aim);
}

// A part of the domain with a tolerance of its own.
struct ToleranceRegion {
  std::array<double, 2> u = {0, 1};  // from and to
  std::array<double, 2> v = {0, 1};  // from and to
  double tolerance_mm = 0.5;         // in place of the plan's

  bool Holds(double at_u, double at_v) const {
    return at_u >= u[0] && at_u <= u[1] && at_v >= v[0] && at_v <= v[1];
  }
};
template <class Visitor>
void Fields(Visitor& visit, ToleranceRegion& o) {
  visit(FieldInfo{.name = "u", .min = 0, .max = 1, .doc = "from and to; both belong to it"}, o.u);
  visit(FieldInfo{.name = "v", .min = 0, .max = 1, .doc = "from and to; both belong to it"}, o.v);
  visit(FieldInfo{.name = "tolerance_mm",
                  .unit = "mm",
                  .min = 1e-9,
                  .max = 1e3,
                  .doc = "in place of the plan's, of points in this part of the domain"},
        o.tolerance_mm);
}

// All levels at once, and finer ones only where they are needed: the surface is solved for as one
// linear least-squares problem in the vertices of level 0 and the edited ones of finer levels;
// where a patch then has a point farther off than the tolerance, it is overlaid with vertices of
// the next finer level, and so on.
struct AdaptivePlan {
  static constexpr std::string_view kName = "adaptive";
  double tolerance_mm = 0.5;                  // a point farther off asks for finer vertices
  std::vector<ToleranceRegion> regions = {};  // the last one that holds a point counts
  int finest = 4;                             // level that may be overlaid
  int margin = 0;                             // rings of finer vertices beyond the patch
  int min_points = 9;  // of a patch; with fewer it stays, as they may be outliers

  // Of a point at (u,v): that of the last region that holds it, or else the plan's.
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
                         "vertices; at least about five times the points' noise"},
        o.tolerance_mm);
  visit(FieldInfo{.name = "regions",
                  .doc = "parts of the domain with tolerances of their own, such as [{u: [0.4, "
                         "0.6], v: [0.3, 0.5], tolerance_mm: 0.1}]; where several hold a point, "
                         "the last counts"},
        o.regions);
  visit(FieldInfo{.name = "finest",
                  .min = 0,
                  .max = 8,
                  .doc = "finest level that may be overlaid; at most that of the surface"},
        o.finest);
  visit(FieldInfo{.name = "margin",
                  .min = 0,
                  .max = 8,
                  .doc = "rings of finer vertices beyond those over the patch itself"},
        o.margin);
  visit(FieldInfo{.name = "min_points",
                  .min = 1,
                  .max = 1e6,
                  .doc = "a patch with fewer points is left as it is, so that single outliers are "
                         "not chased"},
        o.min_points);
}

enum class OutlierRule { kDrop, kKeep };
constexpr auto EnumNames(OutlierRule) { return std::to_array<std::string_view>({"drop", "keep"}); }

// How fine, how smooth and which points to believe: all from the points (fitting/nested/). Its
// terms are `points` and `smoothness` with `weight: auto`.
struct AutoPlan {
  static constexpr std::string_view kName = "auto";
  int finest = 7;                             // level, however dense the points are
  OutlierRule outliers = OutlierRule::kDrop;  // keep: every point is believed
  int relaxation_rounds = 0;                  // of moves of (u,v) before the fit, at most
  bool stretched = true;                      // smoothness may be measured in stretched lengths
};
template <class Visitor>
void Fields(Visitor& visit, AutoPlan& o) {
  visit(FieldInfo{.name = "finest",
                  .min = 0,
                  .max = 8,
                  .doc = "finest level that may be overlaid, however dense the points are"},
        o.finest);
  visit(
      FieldInfo{.name = "outliers",
                .doc = "drop: points that agree with none of their neighbours have no weight, and "
                       "are listed; keep: every point is believed"},
      o.outliers);
  visit(FieldInfo{.name = "relaxation_rounds",
                  .min = 0,
                  .max = 20,
                  .doc = "in how many rounds at most, before the fit, each point's (u,v) move to "
                         "the foot of its perpendicular on a coarse surface, for (u,v) that are "
                         "only about right; 0: they stay as they are. For `semblance fit`, without "
                         "exact points"},
        o.relaxation_rounds);
  visit(
      FieldInfo{.name = "stretched",
                .doc = "true: where the surface bends plainly less along one direction, as a ridge "
                       "along its crest, bending counts more along it and less across it "
                       "(smoothness.stretch), if that predicts better; false: alike"},
      o.stretched);
}

// How every plan goes to the minimum of its terms.
enum class Solver {
  kCeres,   // ceres::Problems, whose parameter blocks are the control vertices
  kFastest  // a direct factorisation where the terms allow it, else Ceres; the same minimiser
};
constexpr auto EnumNames(Solver) { return std::to_array<std::string_view>({"ceres", "fastest"}); }

using SchedulePlan = std::variant<ListedPlan, CoarseToFinePlan, UntilPlan, AdaptivePlan, AutoPlan>;

// The steps of one pass of a plan that goes level by level; none of the adaptive plan.
std::vector<ScheduleStep> StepsOf(const SchedulePlan& plan);
// What the levels of a plan aim at; the adaptive plan solves for the surface.
FitAim AimOf(const SchedulePlan& plan);
// The finest level that a plan names; 0 of the auto plan, which takes the levels that it needs.
int FinestLevelOf(const SchedulePlan& plan);
// The finest level that a surface of this shape may come to by the plan: with the auto plan its
// finest, or as many as kMostPatches allow.
int FinestAllowed(const SchedulePlan& plan, const HSplineShape& shape);

}  // namespace semblance
