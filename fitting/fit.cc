// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "fitting/nested/nested_fit.h"
#include "fitting/plan/alone_fit.h"
#include "fitting/plan/fit_check.h"
#include "fitting/plan/fit_driver.h"
#include "fitting/solve/auto_weight.h"
#include "fitting/solve/space_solve.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline/feature.h"

namespace semblance::fitting {
namespace {

// One step at fraction 1 for every level of the steps, coarse to fine.
std::vector<ScheduleStep> MakeSweep(const std::vector<ScheduleStep>& steps) {
  std::set<int> levels;
  for (const ScheduleStep& step : steps) {
    levels.insert(step.level);
  }
  std::vector<ScheduleStep> sweep;
  for (const int level : levels) {
    sweep.push_back({level, 1});
  }
  return sweep;
}

// Moves the vertices to c + fraction (c' - c). A vertex that did not move in the solve, or that is
// in `stay`, keeps its exact bits. Sets the summary's longest move and number of moved vertices.
void WriteBack(ControlNet solved, const ScheduleStep& step, std::span<const int> stay,
               HSplineSurface& surface, LevelSummary& summary) {
  ControlNet net = surface.Net(step.level);
  summary.max_move_mm = 0;
  summary.moved_vertices = 0;
  for (const int k : stay) {
    solved.vertices[k] = net.vertices[k];
  }
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    const Vec3 move = step.fraction * (solved.vertices[k] - net.vertices[k]);
    net.vertices[k] += move;
    summary.max_move_mm = std::max(summary.max_move_mm, move.norm());
    summary.moved_vertices += move.norm() >= kLeastMove_mm ? 1 : 0;
  }
  surface.SetNet(step.level, net);
}

// The weight of the PriorTerm that holds features; 0 for rules without one.
double FeaturePriorWeight(const FeatureRule& rule) {
  // Holds frozen features in the solve, whose offsets are then restored; larger weights cost
  // digits.
  constexpr double kFrozen = 1e6;
  const auto* const weighted = std::get_if<WeightedFeatures>(&rule);
  return weighted != nullptr                            ? weighted->weight
         : std::holds_alternative<FrozenFeatures>(rule) ? kFrozen
                                                        : 0;
}

// Returns whether all terms are terms of the points, so that nothing determines the surface where
// there are no points.
bool AreOfPointsAlone(std::span<const Term> terms) {
  return std::all_of(terms.begin(), terms.end(), [](const Term& term) {
    return TermWeight(term) == 0 || std::holds_alternative<PointTerm>(term) ||
           std::holds_alternative<LandmarkTerm>(term);
  });
}

// The weight of the thin-plate energy (length_mm 1, points of weight 1) that halves waves as long
// as two spacings of points. The points do not contain shorter waves. Longer ones hardly change,
// because the damping falls with the fourth power of the length.
double SpacingWeight(const Vec2& lengths_mm, std::size_t points) {
  const double spacing_mm = std::sqrt(lengths_mm.prod() / static_cast<double>(points));
  return std::pow(spacing_mm / std::numbers::pi, 4);
}

// Returns whether an adaptive plan may split patches until the points do not determine the
// vertices.
bool MaySplitTooFar(const FitOptions& options, const HSplineShape& shape, std::size_t points) {
  constexpr double kPointsPerPatch = 16;  // as many as a patch has vertices
  const auto* const plan = std::get_if<AdaptivePlan>(&options.plan);
  return plan != nullptr &&
         static_cast<double>(points) < kPointsPerPatch * shape.PatchesU(plan->finest) *
                                           static_cast<double>(shape.PatchesV(plan->finest));
}

// The terms of the options, and those that the plan and the features need.
std::vector<Term> MakeTerms(const FitOptions& options, const HSplineSurface& rest,
                            std::size_t points) {
  std::vector<Term> terms = options.terms;
  const Vec2 lengths_mm = MeanLengths(rest);
  if (AreOfPointsAlone(terms) && MaySplitTooFar(options, rest.shape(), points) &&
      lengths_mm.allFinite() && lengths_mm.minCoeff() > 0) {
    terms.emplace_back(SmoothnessTerm{
        .weight = PointWeight(terms) * SpacingWeight(lengths_mm, points), .length_mm = 1});
  }
  if (const double weight = FeaturePriorWeight(options.features); weight > 0) {
    terms.emplace_back(PriorTerm{.weight = weight, .held_only = true});
  }
  return terms;
}

// The same surface with levels 0 .. max_level, which must contain all of its offsets.
HSplineSurface WithLevels(const HSplineSurface& surface, int max_level) {
  HSplineShape shape = surface.shape();
  shape.max_level = max_level;
  HSplineSurface same(shape, surface.Net(0));
  same.SetOffsets({surface.Offsets().begin(), surface.Offsets().end()});
  return same;
}

// Throws InputError if the surface misses an exact point.
void CheckMet(const AdaptiveSolve& all, const FitTarget& target) {
  const std::vector<double> misses = all.ExactMisses();
  const auto worst = std::max_element(misses.begin(), misses.end());
  if (worst == misses.end() || *worst <= all.MissTolerance_mm()) {
    return;
  }
  const Vec2& uv = target.exact[static_cast<std::size_t>(worst - misses.begin())].uv;
  throw InputError(
      fmt::format("fit: the exact point at (u,v) = ({:.6g}, {:.6g}) is missed by {:.3g} mm: it "
                  "contradicts others, or they are closer together than vertices; leave some out, "
                  "or give more patches or finer levels",
                  uv.x(), uv.y(), *worst));
}

// The target without its outliers.
FitTarget Without(std::span<const std::uint32_t> outliers, FitTarget target) {
  std::vector<FitPoint> kept;
  auto next = outliers.begin();
  for (std::uint32_t k = 0; k < target.points.size(); ++k) {
    if (next != outliers.end() && *next == k) {
      ++next;
    } else {
      kept.push_back(std::move(target.points[k]));
    }
  }
  target.points = std::move(kept);
  return target;
}

// Sets the `auto` weight of a smoothness term, if there is one, to the weight and stretch that the
// plan has chosen for points of weight 1 and a length of 1 mm.
std::vector<Term> WithSmoothness(std::span<const Term> terms, const AutoReport& chosen) {
  std::vector<Term> all(terms.begin(), terms.end());
  if (const int automatic = AutoTerm(all); automatic >= 0) {
    auto& smooth = std::get<SmoothnessTerm>(all[automatic]);
    smooth.stretch = chosen.stretch;
    smooth.direction_deg = chosen.direction_deg;
    SetWeight(chosen.weight * WeightAsWritten(all, smooth.length_mm), all[automatic]);
  }
  return all;
}

// An exact point is never an outlier.
void KeepExactPoints(const FitTarget& target, std::vector<std::uint32_t>& outliers) {
  std::erase_if(outliers, [&](std::uint32_t k) {
    const FitPoint& point = target.points[k];
    return std::ranges::any_of(target.exact, [&](const ExactPoint& exact) {
      return exact.uv == point.uv && exact.position == point.position;
    });
  });
}

// The points of a target as columns.
class PointColumns {
 public:
  explicit PointColumns(const FitTarget& target) {
    for (const FitPoint& p : target.points) {
      positions_.push_back(p.position);
      uv_.push_back(p.uv);
      weights_.push_back(p.weight);
    }
  }
  ScatteredPoints Points() const { return {positions_, uv_, weights_}; }

 private:
  std::vector<Vec3> positions_;
  std::vector<Vec2> uv_;
  std::vector<double> weights_;
};

// Runs a fit by any plan. The plans that fit level by level and the adaptive plan drive their
// solves through a FitDriver, which also relaxes the points.
class Fitter {
 public:
  Fitter(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
         std::span<const VertexId> features, const FitOptions& options, const RunContext& context)
      : rest_(rest),
        features_(features.begin(), features.end()),
        options_(options),
        context_(context),
        result_{.surface = start},
        driver_(rest, target, options, MakeTerms(options, rest, target.points.size()), context,
                result_) {
    std::sort(features_.begin(), features_.end());
    features_.erase(std::unique(features_.begin(), features_.end()), features_.end());
  }

  FitResult Run() {
    std::visit([&](const auto& plan) { Follow(plan); }, options_.plan);
    driver_.Finish(features_);
    return std::move(result_);
  }

 private:
  // Runs a plan that fits level by level once.
  template <class Plan>
  void Follow(const Plan& plan) {
    const std::vector<ScheduleStep> steps = PlanSteps(plan);
    FollowPasses(steps, /*passes=*/1, /*least_gain_mm=*/0, plan.sweeps);
  }

  void Follow(const UntilPlan& plan) {
    FollowPasses(plan.schedule, plan.max_passes, plan.tolerance_mm, plan.sweeps);
  }

  // Runs passes over the steps while each lowers the points' rms distance by more than
  // least_gain_mm, and then the back-fitting sweeps.
  void FollowPasses(const std::vector<ScheduleStep>& steps, int passes, double least_gain_mm,
                    int sweeps) {
    const std::vector<ScheduleStep> sweep = MakeSweep(steps);
    const std::size_t most = passes * steps.size() + sweeps * sweep.size();
    for (int pass = 0; pass < passes; ++pass) {
      const double before_mm = driver_.rms_mm();
      RunSteps(steps, most);
      if (!(before_mm - driver_.rms_mm() > least_gain_mm)) {
        break;
      }
    }
    for (int k = 0; k < sweeps; ++k) {
      RunSteps(sweep, most);
    }
  }

  void RunSteps(const std::vector<ScheduleStep>& steps, std::size_t most_steps) {
    for (const ScheduleStep& step : steps) {
      context_.ThrowIfStopped();
      context_.Report("fit", fmt::format("level {}, fraction {}", step.level, step.fraction),
                      static_cast<double>(result_.levels.size()) / static_cast<double>(most_steps));
      driver_.Take({.solve = [&](std::span<const Term> terms,
                                 SolveReport report) { return SolveLevel(step, terms, report); },
                    .level = step.level,
                    .view = [&](const FitTarget& target) { return View(step.level, target); }});
    }
  }

  // The features that a term holds.
  std::span<const VertexId> Held() const {
    return FeaturePriorWeight(options_.features) > 0 ? features_ : std::span<const VertexId>();
  }

  LevelView View(int level, const FitTarget& target) const {
    return MakeLevelView(result_.surface, rest_, target, level,
                         {.aim = PlanAim(options_.plan), .held = Held(), .terms = options_.terms});
  }

  LevelSummary SolveLevel(const ScheduleStep& step, std::span<const Term> terms,
                          SolveReport report) {
    LevelView view = View(step.level, driver_.target());
    const bool frozen = std::holds_alternative<FrozenFeatures>(options_.features);
    const std::vector<int> stay = frozen ? view.held : std::vector<int>();
    LevelSolution solution = PlanAim(options_.plan) == FitAim::kLevel
                                 ? FitLevelHeld(view, terms, options_.solver, report)
                                 : FitLevel(std::move(view), terms, options_.solver, report);
    LevelSummary summary = std::move(solution.summary);
    summary.level = step.level;
    summary.fraction = step.fraction;
    WriteBack(std::move(solution.net), step, stay, result_.surface, summary);
    summary.rms_before_mm = driver_.rms_mm();
    summary.rms_after_mm = report == SolveReport::kFull
                               ? PointRms(result_.surface, driver_.target(), context_.threads)
                               : kNaN;
    return summary;
  }

  void Follow(const AdaptivePlan& plan) {
    const Feature features = ExtractFeature(result_.surface, "features", features_);
    AdaptiveSolve all({.start = result_.surface,
                       .rest = rest_,
                       .target = driver_.target(),
                       .terms = driver_.terms(),
                       .held = Held(),
                       .solver = options_.solver,
                       .threads = context_.threads});

    const auto solve = [&](std::span<const Term>, SolveReport report) {
      UpdatePoints(all);
      const LevelSummary summary = all.Solve(SolveTolerance::kLoose, report);
      if (driver_.MovesPoints()) {
        AdoptSurface(all, features);
      }
      return summary;
    };
    for (bool more = true; more; more = all.Refine(plan)) {
      context_.ThrowIfStopped();
      context_.Report("fit", fmt::format("{} vertices to level {}", all.dofs(), all.finest()));
      driver_.Take({.solve = solve});
      UpdatePoints(all);
    }
    driver_.Solve({.solve = [&](std::span<const Term>, SolveReport) {
      LevelSummary summary = all.FinalSolve();
      CheckMet(all, driver_.target());
      if (AdoptSurface(all, features)) {
        summary.rms_after_mm = PointRms(result_.surface, driver_.target(), context_.threads);
      }
      return summary;
    }});
  }

  // The auto plan with Ceres, further terms or exact points. (Otherwise Fit() calls FitAlone
  // directly.)
  void Follow(const AutoPlan&) {
    const ControlNet start = result_.surface.Net(0);
    const PointColumns points(driver_.target());
    FitResult alone =
        FitAlone(result_.surface, points.Points(), std::get<AutoPlan>(options_.plan), context_);
    result_.surface = std::move(alone.surface);
    result_.automatic = std::move(alone.automatic);
    for (const LevelSummary& level : alone.levels) {
      driver_.Solve({.solve = [&](std::span<const Term>, SolveReport) { return level; }});
    }
    driver_.Solve({.solve = [&](std::span<const Term> terms, SolveReport) {
      return SolveAllTerms(terms, start);
    }});
    UpdateReport(result_.surface, points.Points(), alone.residual_mm, context_.threads,
                 *result_.automatic);
    KeepExactPoints(driver_.target(), result_.automatic->outliers);
  }

  // Finds the minimum of all terms in the space of the auto plan, with its smoothness and without
  // its outliers. Finer vertices are added where exact points need them.
  LevelSummary SolveAllTerms(std::span<const Term> terms, const ControlNet& rest) {
    context_.Report("fit", "all terms");
    const FitTarget kept = Without(result_.automatic->outliers, driver_.target());
    const std::vector<Term> weighed = WithSmoothness(terms, *result_.automatic);
    const bool exact = !kept.exact.empty();
    const HSplineSurface start =
        exact ? WithLevels(result_.surface, FinestAllowed(options_.plan, result_.surface.shape()))
              : result_.surface;
    const HSplineSurface flat(start.shape(), rest);
    AdaptiveSolve all({.start = start,
                       .rest = flat,
                       .target = kept,
                       .terms = weighed,
                       .solver = options_.solver,
                       .threads = context_.threads,
                       .final_loss_width = true});
    const AdaptivePlan where_unmet{.tolerance_mm = std::numeric_limits<double>::infinity(),
                                   .finest = start.shape().max_level};

    LevelSummary summary = all.FinalSolve();
    while (exact && all.Refine(where_unmet)) {
      summary = all.FinalSolve();
    }
    CheckMet(all, kept);
    result_.surface = exact ? WithLevels(all.Surface(), all.finest()) : all.Surface();
    summary.rms_after_mm = PointRms(result_.surface, driver_.target(), context_.threads);
    return summary;
  }

  void UpdatePoints(AdaptiveSolve& all) const {
    if (driver_.MovesPoints()) {
      all.UpdatePoints();
    }
  }

  // Adopts the solved surface. A term has held frozen features in space, but their offsets must
  // keep their exact bits and turn with the coarser surface, so they are restored. Returns whether
  // there are any.
  bool AdoptSurface(const AdaptiveSolve& all, const Feature& features) {
    const bool frozen =
        std::holds_alternative<FrozenFeatures>(options_.features) && !features_.empty();
    result_.surface = all.Surface();
    if (frozen) {
      RestoreFeature(features, features_, result_.surface);
    }
    return frozen;
  }

  const HSplineSurface& rest_;
  std::vector<VertexId> features_;  // each once
  const FitOptions& options_;
  const RunContext& context_;
  FitResult result_;
  FitDriver driver_;
};

}  // namespace

FitResult Fit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context) {
  CheckFit(start, rest, target, features, options);
  if (IsAlone(options) && target.exact.empty()) {
    return FitAlone(start, PointColumns(target).Points(), std::get<AutoPlan>(options.plan),
                    context);
  }
  return Fitter(start, rest, target, features, options, context).Run();
}

FitResult Fit(const HSplineSurface& start, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context) {
  return Fit(start, start, target, features, options, context);
}

FitResult Fit(const HSplineSurface& start, const ScatteredPoints& points, const FitOptions& options,
              const RunContext& context) {
  if (!IsAlone(options)) {
    return Fit(start, MakeFitTarget(points.positions, points.uv, points.weights), {}, options,
               context);
  }
  CheckFit(start, points, options);
  return FitAlone(start, points, std::get<AutoPlan>(options.plan), context);
}

}  // namespace semblance::fitting
