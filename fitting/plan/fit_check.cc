// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/plan/fit_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "fitting/solve/auto_weight.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"

namespace semblance::fitting {
namespace {

[[noreturn]] void Fail(const std::string& what) { throw InputError("fit: " + what); }

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

class FaultFinder {
 public:
  FaultFinder(const FitOptions& options, int max_level)
      : options_(options),
        max_level_(max_level),
        adaptive_(std::holds_alternative<AdaptivePlan>(options.plan)),
        auto_(std::holds_alternative<AutoPlan>(options.plan)) {}

  std::vector<FitFault> Take() {
    std::visit([&](const auto& plan) { Plan(plan); }, options_.plan);
    if (adaptive_) {
      NeedPoints("the adaptive plan has no term 'points' with a weight; add one", "terms");
    }
    if (auto_) {
      TermsOfAutoPlan();
    } else {
      AutoWeights();
    }
    FindRelaxation();
    OneTermOfRows();
    return std::move(faults_);
  }

 private:
  // The view of a level has one list of what finer levels add to rows.
  void OneTermOfRows() {
    int count = 0;
    for (std::size_t k = 0; k < options_.terms.size(); ++k) {
      count += std::holds_alternative<RowsTerm>(options_.terms[k]) ? 1 : 0;
      if (count > 1) {
        Add(fmt::format("terms[{}]", k), "the term 'rows' is there twice; put all rows into one");
        return;
      }
    }
  }

  void Add(std::string path, std::string what) {
    faults_.push_back({std::move(path), std::move(what)});
  }

  void Level(std::string path, int level) {
    if (level < 0) {
      Add(std::move(path), fmt::format("level {} is negative; the coarsest is 0", level));
    } else if (level > max_level_) {
      faults_.push_back({std::move(path),
                         fmt::format("level {} is finer than the surface, whose finest level is "
                                     "{}; give a level up to that",
                                     level, max_level_),
                         /*too_fine=*/true});
    }
  }

  void Fraction(std::string path, double fraction) {
    if (!(fraction >= 0 && fraction <= 1)) {
      Add(std::move(path), fmt::format("the fraction {} is not in 0..1", fraction));
    }
  }

  template <class PlanWithSchedule>
  void Plan(const PlanWithSchedule& plan) {
    if (plan.schedule.empty()) {
      Add("plan.schedule", "it is empty; give at least one {level, fraction}");
    }
    for (std::size_t k = 0; k < plan.schedule.size(); ++k) {
      const std::string step = fmt::format("plan.schedule[{}]", k);
      Level(step + ".level", plan.schedule[k].level);
      Fraction(step + ".fraction", plan.schedule[k].fraction);
    }
  }
  void Plan(const CoarseToFinePlan& plan) {
    Level("plan.finest", plan.finest);
    Fraction("plan.fraction", plan.fraction);
  }
  void Plan(const AdaptivePlan& plan) {
    Level("plan.finest", plan.finest);
    for (std::size_t k = 0; k < plan.regions.size(); ++k) {
      const ToleranceRegion& region = plan.regions[k];
      if (!(region.u[0] < region.u[1] && region.v[0] < region.v[1])) {
        Add(fmt::format("plan.regions[{}]", k),
            fmt::format("[{}, {}] x [{}, {}] holds nothing; give the lower bound first",
                        region.u[0], region.u[1], region.v[0], region.v[1]));
      }
    }
  }
  // The surface takes the levels that it needs. (u,v) are moved before the fit, by `semblance fit`.
  void Plan(const AutoPlan& plan) {
    if (plan.relaxation_rounds > 0) {
      Add("plan.relaxation_rounds",
          "(u,v) are moved by `semblance fit` alone; write relaxation_rounds: 0, or take another "
          "plan with relaxation: footpoint");
    }
  }

  // The options must list the terms that the auto plan weighs, and must not fix what it chooses by
  // itself. With Ceres further terms are allowed, in the space that the plan has found.
  void TermsOfAutoPlan() {
    const bool ceres = options_.solver == Solver::kCeres;
    int automatic = 0, points = 0, smooth = 0;
    for (int k = 0; k < std::ssize(options_.terms); ++k) {
      const Term& term = options_.terms[k];
      const bool weighed = AutoTerm(std::span(&term, 1)) >= 0;
      const bool known = (ceres && !weighed) || IsOfAutoPlan(term);
      automatic += weighed ? 1 : 0;
      points += std::holds_alternative<PointTerm>(term) ? 1 : 0;
      smooth += std::holds_alternative<SmoothnessTerm>(term) ? 1 : 0;
      const bool again = !ceres && points > 1 && std::holds_alternative<PointTerm>(term);
      if (again) {
        Add(fmt::format("terms[{}]", k),
            "the auto plan weighs one 'points'; leave this one out, or take plan: adaptive");
      } else if (!known || automatic > 1) {
        Add(fmt::format("terms[{}]", k),
            "the auto plan weighs 'points' without a loss (it finds outliers by itself) and one "
            "'smoothness' of the displacement with weight: auto, whose stretch it finds; leave "
            "'terms' out, or take plan: adaptive; other terms, with numbers as weights, need "
            "solver: ceres");
      }
    }
    NeedPoints("the auto plan has no term 'points' with a weight; add one", "terms");
    if (smooth == 0) {
      Add("terms",
          "the auto plan always weighs a 'smoothness'; add {type: smoothness, weight: auto}, or "
          "take plan: adaptive");
    }
    if (!std::holds_alternative<NoRelaxation>(options_.relaxation)) {
      Add("relaxation",
          "the auto plan moves no (u,v) between its solves; write relaxation: none and, to move "
          "them before the fit, plan: {type: auto, relaxation_rounds: 3}, or take plan: adaptive");
    }
  }

  static bool IsOfAutoPlan(const Term& term) {
    const auto* const points = std::get_if<PointTerm>(&term);
    const auto* const smooth = std::get_if<SmoothnessTerm>(&term);
    return points != nullptr
               ? points->loss == RobustLoss::kNone
               : smooth != nullptr && smooth->weight.automatic &&
                     smooth->of == SmoothnessOf::kDisplacement && smooth->stretch == 1;
  }

  // Returns the first term `points` with a weight; adds a fault if there is none.
  const PointTerm* NeedPoints(std::string what, std::string path) {
    for (const Term& term : options_.terms) {
      const auto* const points = std::get_if<PointTerm>(&term);
      if (points != nullptr && points->weight > 0) {
        return points;
      }
    }
    Add(std::move(path), std::move(what));
    return nullptr;
  }

  // Generalised cross-validation needs one matrix for x, y and z.
  void AutoWeights() {
    int automatic = -1;
    for (int k = 0; k < std::ssize(options_.terms); ++k) {
      if (AutoTerm(std::span(&options_.terms[k], 1)) < 0) {
        continue;
      }
      if (automatic >= 0) {
        Add(fmt::format("terms[{}].weight", k),
            fmt::format("the terms '{}' and '{}' both have weight: auto; give one of them a number",
                        TermName(options_.terms[automatic]), TermName(options_.terms[k])));
      }
      automatic = k;
    }
    for (int k = 0; automatic >= 0 && k < std::ssize(options_.terms); ++k) {
      if (!SeparableButForLoss(std::span(&options_.terms[k], 1))) {
        Add(fmt::format("terms[{}]", k),
            fmt::format("weight: auto cannot be chosen beside the term '{}', which does not treat "
                        "x, y and z alike; give a number",
                        TermName(options_.terms[k])));
      }
    }
  }

  // Checks the relaxations that do more than move points between fits.
  void FindRelaxation() {
    const bool slides = std::holds_alternative<TangentDistanceRelaxation>(options_.relaxation);
    if (!slides && !std::holds_alternative<JointRelaxation>(options_.relaxation)) {
      return;
    }
    const std::string_view name =
        std::visit([](const auto& chosen) { return chosen.kName; }, options_.relaxation);
    const PointTerm* const points = NeedPoints(
        fmt::format("the relaxation {} needs a term 'points' with a weight; add one", name),
        "relaxation");
    if (points != nullptr && slides && points->loss != RobustLoss::kNone) {
      Add("relaxation",
          fmt::format("the relaxation {} lets points slide without a loss; write loss: none for "
                      "the term 'points', or take alternating or joint",
                      name));
    }
    if (adaptive_) {
      Add("relaxation", fmt::format("the relaxation {} goes level by level; with the adaptive plan "
                                    "take footpoint or alternating",
                                    name));
    }
  }

  const FitOptions& options_;
  int max_level_;
  bool adaptive_, auto_;
  std::vector<FitFault> faults_;
};

}  // namespace

std::vector<FitFault> FindFitFaults(const FitOptions& options, int max_level) {
  return FaultFinder(options, max_level).Take();
}

namespace {

void CheckOptions(const FitOptions& options, int max_level) {
  for (const FitFault& fault : FindFitFaults(options, max_level)) {
    Fail(fmt::format("{}: {}", fault.path, fault.what));
  }
}

void CheckExact(std::span<const ExactPoint> exact, const FitOptions& options) {
  if (exact.empty()) {
    return;
  }
  const bool at_once = std::holds_alternative<AdaptivePlan>(options.plan) ||
                       std::holds_alternative<AutoPlan>(options.plan);
  if (!at_once || options.solver != Solver::kFastest || !SeparableButForLoss(options.terms) ||
      !std::holds_alternative<NoRelaxation>(options.relaxation)) {
    Fail(
        "exact points need plan: auto or adaptive, solver: fastest, terms that treat x, y and z "
        "alike, and relaxation: none");
  }
  if (exact.size() > kMaxExactPoints) {
    Fail(fmt::format("{} exact points are more than {}; leave some out", exact.size(),
                     kMaxExactPoints));
  }
  for (const ExactPoint& point : exact) {
    if (!point.position.allFinite() || !point.normal.allFinite() ||
        !((point.uv.array() >= 0).all() && (point.uv.array() <= 1).all())) {
      Fail(fmt::format("the exact point at (u,v) = ({}, {}) is not finite, or outside the domain",
                       point.uv.x(), point.uv.y()));
    }
  }
}

}  // namespace

std::vector<std::string> UnusedOptions(const FitOptions& options) {
  std::vector<std::string> notes;
  for (std::size_t k = 0; k < options.terms.size(); ++k) {
    const auto* points = std::get_if<PointTerm>(&options.terms[k]);
    if (points != nullptr && points->loss == RobustLoss::kNone &&
        points->loss_width_mm != PointTerm().loss_width_mm) {
      notes.push_back(fmt::format("terms[{}].loss_width_mm: `loss: none` ignores it", k));
    }
  }
  return notes;
}

void CheckFit(const HSplineSurface& start, const ScatteredPoints& points,
              const FitOptions& options) {
  if (points.size() == 0) {
    Fail("there is no point; give some");
  }
  CheckPoints(points);
  CheckOptions(options, start.shape().max_level);
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
  CheckExact(target.exact, options);
  CheckOptions(options, start.shape().max_level);
  CheckFeatures(features, start.shape());
  if (std::holds_alternative<AutoPlan>(options.plan) && !features.empty()) {
    Fail("the auto plan does not protect features; take plan: adaptive");
  }
}

}  // namespace semblance::fitting
