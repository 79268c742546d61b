// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/fit_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

[[noreturn]] void Fail(const std::string& what) { throw InputError("fit: " + what); }

void CheckSchedule(const std::vector<ScheduleStep>& schedule, int max_level) {
  if (schedule.empty()) {
    Fail("the schedule is empty; give at least one {level, fraction}");
  }
  for (std::size_t i = 0; i < schedule.size(); ++i) {
    if (schedule[i].level < 0 || schedule[i].level > max_level) {
      Fail(fmt::format("step {} of the schedule asks for level {}; the surface has levels 0..{}", i,
                       schedule[i].level, max_level));
    }
    if (!(schedule[i].fraction >= 0 && schedule[i].fraction <= 1)) {
      Fail(fmt::format("step {} of the schedule has the fraction {}; allowed are 0..1", i,
                       schedule[i].fraction));
    }
  }
}

void CheckFeatures(std::span<const VertexId> features, const HSplineShape& shape) {
  for (const VertexId& f : features) {
    if (f.level < 1 || f.level > shape.max_level) {
      Fail(
          fmt::format("feature vertex ({}, {}) is of level {}; features are offsets, of levels "
                      "1..{}",
                      f.i, f.j, f.level, shape.max_level));
    }
    if (f.i < 0 || f.i >= shape.Columns(f.level) || f.j < 0 || f.j >= shape.Rows(f.level)) {
      Fail(fmt::format("feature vertex ({}, {}) is not among the {} x {} of level {}", f.i, f.j,
                       shape.Columns(f.level), shape.Rows(f.level), f.level));
    }
  }
}

// Relaxations that are more than moves of points between fits.
void CheckRelaxation(const FitOptions& options) {
  const bool slides = std::holds_alternative<TangentDistanceRelaxation>(options.relaxation);
  if (!slides && !std::holds_alternative<JointRelaxation>(options.relaxation)) {
    return;
  }
  const std::string_view name =
      std::visit([](const auto& chosen) { return chosen.kName; }, options.relaxation);
  const auto points = std::find_if(options.terms.begin(), options.terms.end(), [](const Term& t) {
    const auto* const p = std::get_if<PointTerm>(&t);
    return p != nullptr && p->weight > 0;
  });
  if (points == options.terms.end()) {
    Fail(fmt::format("the relaxation {} needs a term 'points' with a weight; add one", name));
  }
  if (slides && std::get<PointTerm>(*points).loss != RobustLoss::kNone) {
    Fail(
        fmt::format("the relaxation {} lets points slide without a loss; write loss: none "
                    "for the term 'points', or take alternating or joint",
                    name));
  }
  if (std::holds_alternative<AdaptivePlan>(options.plan)) {
    Fail(
        fmt::format("the relaxation {} goes level by level; with the adaptive plan take "
                    "footpoint or alternating",
                    name));
  }
}

void CheckRule(const FitOptions& options) {
  const bool holds = std::holds_alternative<WeightedFeatures>(options.features) ||
                     std::holds_alternative<FrozenFeatures>(options.features);
  if (holds && std::holds_alternative<AdaptivePlan>(options.plan)) {
    Fail(
        "features that are weighted or frozen need a plan that goes level by level; with the "
        "adaptive plan take restore or free");
  }
}

}  // namespace

std::vector<ScheduleStep> StepsOf(const FitOptions& options) {
  const auto* const plan = std::get_if<CoarseToFinePlan>(&options.plan);
  if (plan == nullptr) {
    return options.schedule;
  }
  std::vector<ScheduleStep> steps;
  for (int level = 0; level <= plan->finest; ++level) {
    steps.push_back({level, plan->fraction});
  }
  return steps;
}

void CheckFit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options) {
  if (!(start.shape() == rest.shape())) {
    Fail("the start and the template differ in shape (patches, levels, closure or reference)");
  }
  if (target.points.empty()) {
    Fail("the target has no point; give dowels or seed some");
  }
  CheckTarget(target);
  CheckRelaxation(options);
  CheckRule(options);
  const auto* const plan = std::get_if<AdaptivePlan>(&options.plan);
  if (plan == nullptr) {
    CheckSchedule(StepsOf(options), start.shape().max_level);
  } else if (plan->finest > start.shape().max_level) {
    Fail(fmt::format("the adaptive plan asks for level {}; the surface has levels 0..{}",
                     plan->finest, start.shape().max_level));
  }
  CheckFeatures(features, start.shape());
}

}  // namespace semblance
