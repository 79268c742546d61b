// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/fit_schedule.h"

#include <algorithm>

namespace semblance::fitting {

std::vector<ScheduleStep> PlanSteps(const SchedulePlan& plan) {
  std::vector<ScheduleStep> steps;
  if (const auto* const list = std::get_if<ListedPlan>(&plan)) {
    steps = list->schedule;
  } else if (const auto* const until = std::get_if<UntilPlan>(&plan)) {
    steps = until->schedule;
  } else if (const auto* const levels = std::get_if<CoarseToFinePlan>(&plan)) {
    for (int level = 0; level <= levels->finest; ++level) {
      steps.push_back({level, levels->fraction});
    }
  }
  return steps;
}

FitAim PlanAim(const SchedulePlan& plan) {
  return std::visit(
      []<class Plan>(const Plan& p) {
        if constexpr (std::is_same_v<Plan, AdaptivePlan> || std::is_same_v<Plan, AutoPlan>) {
          return FitAim::kSurface;
        } else {
          return p.aim;
        }
      },
      plan);
}

int FinestPlanLevel(const SchedulePlan& plan) {
  const auto* const adaptive = std::get_if<AdaptivePlan>(&plan);
  int finest = adaptive != nullptr ? adaptive->finest : 0;
  for (const ScheduleStep& step : PlanSteps(plan)) {
    finest = std::max(finest, step.level);
  }
  return finest;
}

int FinestAllowed(const SchedulePlan& plan, const HSplineShape& shape) {
  const auto* const automatic = std::get_if<AutoPlan>(&plan);
  int finest = automatic != nullptr ? automatic->finest : FinestPlanLevel(plan);
  while (finest > 0 && (std::max(shape.patches_u, shape.patches_v) << finest) > kMaxPatches) {
    --finest;
  }
  return std::max(finest, shape.max_level);
}

}  // namespace semblance::fitting
