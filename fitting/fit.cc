// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "fitting/adaptive_fit.h"
#include "fitting/seeding.h"
#include "surfaces/error.h"
#include "surfaces/feature.h"

namespace semblance {
namespace {

[[noreturn]] void Fail(const std::string& what) { throw InputError("fit: " + what); }

void CheckSchedule(const std::vector<LevelFit>& schedule, int max_level) {
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

void CheckFeatures(std::span<const VertexId> features, int max_level) {
  for (const VertexId& f : features) {
    if (f.level < 1 || f.level > max_level) {
      Fail(
          fmt::format("feature vertex ({}, {}) is of level {}; features are offsets, of levels "
                      "1..{}",
                      f.i, f.j, f.level, max_level));
    }
  }
}

std::vector<LevelFit> StepsOf(const FitOptions& options) {
  const auto* const plan = std::get_if<CoarseToFinePlan>(&options.plan);
  if (plan == nullptr) {
    return options.schedule;
  }
  std::vector<LevelFit> steps;
  for (int level = 0; level <= plan->finest; ++level) {
    steps.push_back({level, plan->fraction});
  }
  return steps;
}

// Every level of the steps, coarse to fine.
std::vector<LevelFit> SweepOf(const std::vector<LevelFit>& steps) {
  std::set<int> levels;
  for (const LevelFit& step : steps) {
    levels.insert(step.level);
  }
  std::vector<LevelFit> sweep;
  for (const int level : levels) {
    sweep.push_back({level, 1});
  }
  return sweep;
}

void CheckInput(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
                std::span<const VertexId> features, const FitOptions& options) {
  if (!(start.shape() == rest.shape())) {
    Fail("the start and the template differ in shape (patches, levels, closure or reference)");
  }
  if (target.points.empty()) {
    Fail("the target has no point; give dowels or seed some");
  }
  CheckTarget(target);
  const auto* const plan = std::get_if<AdaptivePlan>(&options.plan);
  if (plan == nullptr) {
    CheckSchedule(StepsOf(options), start.shape().max_level);
  } else if (plan->finest > start.shape().max_level) {
    Fail(fmt::format("the adaptive plan asks for level {}; the surface has levels 0..{}",
                     plan->finest, start.shape().max_level));
  }
  CheckFeatures(features, start.shape().max_level);
}

PatchGrid GridOf(const HSplineShape& shape, int level) {
  return {.patches_u = shape.PatchesU(level),
          .patches_v = shape.PatchesV(level),
          .periodic_u = shape.closure == Closure::kPeriodicU};
}

// The detail that finer levels add at uv is taken off the point that the level aims at.
Observation Observe(const FitPoint& point, const HSplineSurface& surface, int level, FitAim aim) {
  Observation o{.uv = point.uv, .position = point.position, .weight = point.weight};
  if (aim == FitAim::kSurface && level < surface.shape().max_level) {
    o.position -= surface.Point(point.uv) - surface.LevelDerivative(level, point.uv);
  }
  return o;
}

LevelView ViewOf(int level, const HSplineSurface& surface, const HSplineSurface& rest,
                 const FitTarget& target, FitAim aim) {
  LevelView view{.grid = GridOf(surface.shape(), level),
                 .start = surface.Net(level),
                 .rest = rest.Net(level),
                 .lengths_mm = MeanLengths(GridOf(rest.shape(), 0), rest.Net(0)),
                 .observations = {}};
  view.observations.reserve(target.points.size());
  for (const FitPoint& point : target.points) {
    view.observations.push_back(Observe(point, surface, level, aim));
  }
  return view;
}

// c + fraction (c' - c); a vertex that the solve left alone keeps its bits. Returns the longest
// way.
double WriteBack(const ControlNet& solved, const LevelFit& step, HSplineSurface& surface) {
  ControlNet net = surface.Net(step.level);
  double longest = 0;
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    const Vec3 move = step.fraction * (solved.vertices[k] - net.vertices[k]);
    net.vertices[k] += move;
    longest = std::max(longest, move.norm());
  }
  surface.SetNet(step.level, net);
  return longest;
}

// Sorted, so that no sum depends on the order in which points were given.
double WeightedRms(std::vector<std::array<double, 2>> weight_and_distance) {
  std::sort(weight_and_distance.begin(), weight_and_distance.end());
  double sum = 0, weights = 0;
  for (const auto& [weight, distance] : weight_and_distance) {
    sum += weight * distance * distance;
    weights += weight;
  }
  return weights > 0 ? std::sqrt(sum / weights) : kNaN;
}

double PointRms(const HSplineSurface& surface, const FitTarget& target) {
  std::vector<std::array<double, 2>> all;
  all.reserve(target.points.size());
  for (const FitPoint& p : target.points) {
    all.push_back({p.weight, (surface.Point(p.uv) - p.position).norm()});
  }
  return WeightedRms(std::move(all));
}

LevelSummary FitStep(const LevelFit& step, const HSplineSurface& rest, const FitTarget& target,
                     const FitOptions& options, double rms_before_mm, HSplineSurface& surface) {
  LevelSolution solution = FitLevel(ViewOf(step.level, surface, rest, target, options.aim),
                                    options.terms, options.solver);
  LevelSummary summary = std::move(solution.summary);
  summary.level = step.level;
  summary.fraction = step.fraction;
  summary.max_move_mm = WriteBack(solution.net, step, surface);
  summary.rms_before_mm = rms_before_mm;
  summary.rms_after_mm = PointRms(surface, target);
  return summary;
}

int RestoreFeatures(const HSplineSurface& rest, std::span<const VertexId> features,
                    HSplineSurface& surface) {
  RestoreFeature(ExtractFeature(rest, "rest", features), features, surface);
  return static_cast<int>(std::set(features.begin(), features.end()).size());
}

// known_rms_mm: of all points, if the surface is as the last step left it; else NaN.
void MeasurePoints(const FitTarget& target, double known_rms_mm, FitResult& result) {
  std::vector<std::array<double, 2>> all, dowels;
  all.reserve(target.points.size());
  for (const FitPoint& p : target.points) {
    result.uv.push_back(p.uv);
    result.residual_mm.push_back((result.surface.Point(p.uv) - p.position).norm());
    all.push_back({p.weight, result.residual_mm.back()});
    if (IsSeeded(p)) {
      continue;
    }
    dowels.push_back(all.back());
  }
  const bool seeded = dowels.size() < all.size();
  result.point_rms_mm = std::isnan(known_rms_mm) ? WeightedRms(std::move(all)) : known_rms_mm;
  result.dowel_rms_mm = seeded ? WeightedRms(std::move(dowels)) : result.point_rms_mm;
  result.usable = std::all_of(result.levels.begin(), result.levels.end(),
                              [](const LevelSummary& s) { return s.usable; });
}

// After the surface has changed; the points are where the result has them.
void MeasureAnew(FitTarget target, FitResult& result) {
  for (std::size_t k = 0; k < target.points.size(); ++k) {
    target.points[k].uv = result.uv[k];
  }
  result.uv.clear();
  result.residual_mm.clear();
  MeasurePoints(target, kNaN, result);
}

// Takes the steps of a schedule, with the relaxation after each.
class Fitter {
 public:
  Fitter(const HSplineSurface& rest, const FitTarget& target, const FitOptions& options,
         std::size_t most_steps, const RunContext& context, FitResult& result)
      : rest_(rest),
        given_(target),
        options_(options),
        most_steps_(static_cast<double>(most_steps)),
        context_(context),
        result_(result),
        rms_mm_(PointRms(result.surface, target)) {
    if (options.relaxation.mode != RelaxationMode::kNone) {
      moved_ = target;
      std::vector<Vec2> uv;
      for (const FitPoint& p : target.points) {
        uv.push_back(p.uv);
      }
      mesh_.emplace(rest, uv);
    }
  }

  void TakeAll(const std::vector<LevelFit>& steps) {
    for (const LevelFit& step : steps) {
      context_.ThrowIfStopped();
      context_.Report("fit", fmt::format("level {}, fraction {}", step.level, step.fraction),
                      static_cast<double>(result_.levels.size()) / most_steps_);
      Take(step);
    }
  }

  double rms_mm() const { return rms_mm_; }
  const FitTarget& target() const { return mesh_ ? moved_ : given_; }

 private:
  void Take(const LevelFit& step) {
    result_.levels.push_back(Solve(step));
    if (!mesh_) {
      return;
    }
    const RelaxationOptions& options = options_.relaxation;
    if (options.mode == RelaxationMode::kFootpoint) {
      result_.relaxations.push_back(Move(options.rounds));
      return;
    }
    for (int round = 0; round < options.rounds; ++round) {
      const RelaxationSummary moved = Move(1);
      round == 0 ? result_.relaxations.push_back(moved) : Join(moved, result_.relaxations.back());
      const double rms_before_mm = result_.levels.back().rms_before_mm;
      result_.levels.back() = Solve(step);
      result_.levels.back().rms_before_mm = rms_before_mm;
    }
  }

  LevelSummary Solve(const LevelFit& step) {
    LevelSummary summary = FitStep(step, rest_, target(), options_, rms_mm_, result_.surface);
    rms_mm_ = summary.rms_after_mm;
    return summary;
  }

  RelaxationSummary Move(int rounds) {
    const RelaxationSummary summary =
        Relax(result_.surface, rest_, *mesh_, options_.relaxation, rounds, moved_);
    rms_mm_ = PointRms(result_.surface, moved_);
    return summary;
  }

  static void Join(const RelaxationSummary& next, RelaxationSummary& all) {
    all.after = next.after;
    all.max_move_mm = std::max(all.max_move_mm, next.max_move_mm);
    all.flips_prevented += next.flips_prevented;
    all.steps_shortened += next.steps_shortened;
  }

  const HSplineSurface& rest_;
  const FitTarget& given_;
  const FitOptions& options_;
  double most_steps_;
  const RunContext& context_;
  FitResult& result_;
  double rms_mm_;
  FitTarget moved_;  // the points as relaxation has left them; unused without
  std::optional<DowelMesh> mesh_;
};

}  // namespace

FitResult Fit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& given,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context) {
  CheckInput(start, rest, given, features, options);
  if (std::holds_alternative<AdaptivePlan>(options.plan)) {
    FitResult result = FitAdaptively(start, rest, given, options, context);
    if (options.features == FeatureRule::kRestore && !features.empty()) {
      result.restored_features = RestoreFeatures(rest, features, result.surface);
      MeasureAnew(given, result);
    }
    return result;
  }
  FitResult result{.surface = start};
  const std::vector<LevelFit> steps = StepsOf(options), sweep = SweepOf(steps);
  const auto* const until = std::get_if<UntilPlan>(&options.plan);
  const int passes = until == nullptr ? 1 : until->max_passes;
  Fitter fitter(rest, given, options, passes * steps.size() + options.sweeps * sweep.size(),
                context, result);
  for (int pass = 0; pass < passes; ++pass) {
    const double before_mm = fitter.rms_mm();
    fitter.TakeAll(steps);
    if (until != nullptr && !(before_mm - fitter.rms_mm() > until->tolerance_mm)) {
      break;
    }
  }
  for (int k = 0; k < options.sweeps; ++k) {
    fitter.TakeAll(sweep);
  }
  const bool restore = options.features == FeatureRule::kRestore;
  result.restored_features = restore ? RestoreFeatures(rest, features, result.surface) : 0;
  MeasurePoints(fitter.target(), result.restored_features > 0 ? kNaN : fitter.rms_mm(), result);
  return result;
}

FitResult Fit(const HSplineSurface& start, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context) {
  return Fit(start, start, target, features, options, context);
}

}  // namespace semblance
