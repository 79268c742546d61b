// SPDX-License-Identifier: GPL-3.0-or-later
// In which order the levels of an H-spline are fitted, and how much of each solve is kept.
#pragma once

#include <string_view>
#include <variant>
#include <vector>

#include "surfaces/base/fields.h"

namespace semblance {

// One step of the fit (thesis 4.2): level L is fitted by least squares, and every control vertex
// goes `fraction` of the way to its solution, c + fraction (c' - c).
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

// Thesis 4.4. What is left of a misfit that every level could remove is the product of
// 1 - fraction, 8 % here.
inline std::vector<ScheduleStep> PublishedSchedule() {
  return {{0, 0.4}, {1, 0.35}, {2, 0.35}, {0, 0.35}, {1, 0.3}, {2, 0.3}};
}

// The steps of the list, once.
struct ListedPlan {
  static constexpr std::string_view kName = "listed";
};
template <class Visitor>
void Fields(Visitor&, ListedPlan&) {}

// Levels 0, 1, .. finest, in place of the list.
struct CoarseToFinePlan {
  static constexpr std::string_view kName = "coarse_to_fine";
  int finest = 2;
  double fraction = 1;
};
template <class Visitor>
void Fields(Visitor& visit, CoarseToFinePlan& o) {
  visit(FieldInfo{.name = "finest",
                  .min = 0,
                  .max = 12,
                  .doc = "last level to fit; the list of steps is not used"},
        o.finest);
  visit(FieldInfo{.name = "fraction", .min = 0, .max = 1, .doc = "as that of a step of the list"},
        o.fraction);
}

// The steps of the list again and again, while the points' root mean square distance falls.
struct UntilPlan {
  static constexpr std::string_view kName = "until";
  double tolerance_mm = 0.01;
  int max_passes = 20;
};
template <class Visitor>
void Fields(Visitor& visit, UntilPlan& o) {
  visit(FieldInfo{.name = "tolerance_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "a pass over the list that lowers the points' root mean square distance "
                         "by no more than this is the last"},
        o.tolerance_mm);
  visit(
      FieldInfo{.name = "max_passes", .min = 1, .max = 1000, .doc = "passes over the list at most"},
      o.max_passes);
}

// All levels at once, and finer ones only where they are needed: the surface is solved for as one
// linear least-squares problem in the vertices of level 0 and the edited ones of finer levels;
// where a patch then has a point farther off than the tolerance, it is overlaid with vertices of
// the next finer level, and so on.
struct AdaptivePlan {
  static constexpr std::string_view kName = "adaptive";
  double tolerance_mm = 0.5;
  int finest = 4;
  int margin = 0;
  int min_points = 9;
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
  visit(FieldInfo{.name = "finest",
                  .min = 0,
                  .max = 8,
                  .doc = "finest level that may be overlaid; the list of steps is not used"},
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

using SchedulePlan = std::variant<ListedPlan, CoarseToFinePlan, UntilPlan, AdaptivePlan>;

}  // namespace semblance
