// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "fitting/adaptive_fit.h"
#include "fitting/fit_check.h"
#include "fitting/level/auto_weight.h"
#include "fitting/relaxation/joint_relaxation.h"
#include "surfaces/hspline_files/feature.h"

namespace semblance {
namespace {

// Every level of the steps, coarse to fine.
std::vector<ScheduleStep> SweepOf(const std::vector<ScheduleStep>& steps) {
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

PatchGrid GridOf(const HSplineShape& shape, int level) {
  return {.patches_u = shape.PatchesU(level),
          .patches_v = shape.PatchesV(level),
          .periodic_u = shape.closure == Closure::kPeriodicU};
}

// The detail that finer levels add at uv is taken off the point that the level aims at.
Observation Observe(const FitPoint& point, const HSplineSurface& surface, int level, FitAim aim) {
  Observation o{.uv = point.uv,
                .position = point.position,
                .weight = point.weight,
                .landmark = point.role == PointRole::kLandmark};
  if (aim == FitAim::kSurface && level < surface.shape().max_level) {
    o.position -= surface.Point(point.uv) - surface.LevelDerivative(level, point.uv);
  }
  return o;
}

// held: vertices of any level.
LevelView ViewOf(int level, const HSplineSurface& surface, const HSplineSurface& rest,
                 const FitTarget& target, FitAim aim, const std::set<VertexId>& held) {
  LevelView view{.grid = GridOf(surface.shape(), level),
                 .start = surface.Net(level),
                 .rest = rest.Net(level),
                 .lengths_mm = MeanLengths(GridOf(rest.shape(), 0), rest.Net(0)),
                 .observations = {}};
  view.observations.reserve(target.points.size());
  for (const FitPoint& point : target.points) {
    view.observations.push_back(Observe(point, surface, level, aim));
  }
  for (std::size_t k = 0; k < target.anchors.size(); ++k) {
    const Observation& o = view.observations[k];
    const Vec3 detail = target.points[k].position - o.position;
    if (target.anchors[k].foot.allFinite()) {
      view.bone.push_back({o, target.anchors[k].foot - detail, target.anchors[k].direction});
    }
  }
  for (const VertexId& vertex : held) {
    if (vertex.level == level) {
      view.held.push_back(view.start.Index(vertex.i, vertex.j));
    }
  }
  return view;
}

// c + fraction (c' - c); a vertex that the solve left alone, or that stays, keeps its bits. Returns
// the longest way.
double WriteBack(ControlNet solved, const ScheduleStep& step, std::span<const int> stay,
                 HSplineSurface& surface) {
  ControlNet net = surface.Net(step.level);
  double longest = 0;
  for (const int k : stay) {
    solved.vertices[k] = net.vertices[k];
  }
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

int RestoreTemplateFeatures(const HSplineSurface& rest, std::span<const VertexId> features,
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
    if (p.role == PointRole::kSeed) {
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

// The terms with points that may slide along the surface; what `weight: auto` was before holds.
std::vector<Term> AsTangentPoints(std::vector<Term> terms, double tangential, double auto_weight) {
  if (const int automatic = AutoTerm(terms); automatic >= 0) {
    SetWeight(auto_weight, terms[automatic]);
  }
  for (Term& term : terms) {
    if (const auto* const points = std::get_if<PointTerm>(&term)) {
      term = TangentPointTerm{.weight = points->weight, .tangential = tangential};
    }
  }
  return terms;
}

// The weight of a PriorTerm that holds features.
double FeaturePriorWeight(const FeatureRule& rule) {
  constexpr double kFrozen = 1e6;
  const auto* const weighted = std::get_if<WeightedFeatures>(&rule);
  return weighted != nullptr                            ? weighted->weight
         : std::holds_alternative<FrozenFeatures>(rule) ? kFrozen
                                                        : 0;
}

double SumOfCosts(const LevelSummary& summary) {
  double sum = 0;
  for (const TermCosts& term : summary.terms) {
    sum += term.after;
  }
  return sum;
}

// Takes the steps of a schedule, with the relaxation after each.
class Fitter {
 public:
  Fitter(const HSplineSurface& rest, const FitTarget& target, std::span<const VertexId> features,
         const FitOptions& options, std::size_t most_steps, const RunContext& context,
         FitResult& result)
      : rest_(rest),
        given_(target),
        options_(options),
        terms_(options.terms),
        most_steps_(static_cast<double>(most_steps)),
        context_(context),
        result_(result),
        rms_mm_(PointRms(result.surface, target)),
        moves_(MovesOf(options.relaxation)) {
    if (const double weight = FeaturePriorWeight(options.features); weight > 0) {
      held_.insert(features.begin(), features.end());
      terms_.emplace_back(PriorTerm{.weight = weight, .held_only = true});
    }
    if (moves_) {
      moved_ = target;
      mesh_.emplace(NetworkOf(rest, target, *moves_));
    }
  }

  void TakeAll(const std::vector<ScheduleStep>& steps) {
    for (const ScheduleStep& step : steps) {
      context_.ThrowIfStopped();
      context_.Report("fit", fmt::format("level {}, fraction {}", step.level, step.fraction),
                      static_cast<double>(result_.levels.size()) / most_steps_);
      Take(step);
    }
  }

  double rms_mm() const { return rms_mm_; }
  int frozen() const { return IsFrozen() ? static_cast<int>(held_.size()) : 0; }
  const FitTarget& target() const { return mesh_ ? moved_ : given_; }

 private:
  void Take(const ScheduleStep& step) {
    result_.levels.push_back(Solve(step, terms_));
    if (mesh_) {
      result_.relaxations.emplace_back();
      std::visit([&](const auto& chosen) { After(step, chosen); }, options_.relaxation);
    }
  }

  void After(const ScheduleStep&, const NoRelaxation&) {}
  void After(const ScheduleStep&, const FootpointRelaxation&) { Keep(Move(*moves_)); }
  void After(const ScheduleStep& step, const AlternatingRelaxation&) { Alternate(step); }
  void After(const ScheduleStep& step, const TangentDistanceRelaxation& chosen) {
    Alternate(step);
    Slide(step, chosen);
  }
  void After(const ScheduleStep& step, const JointRelaxation& chosen) {
    for (int round = 0; round < chosen.rounds; ++round) {
      Keep(MoveJointly(step));
      SolveAgain(step, terms_);
    }
  }

  void Alternate(const ScheduleStep& step) {
    for (int round = 0; round < moves_->rounds; ++round) {
      Keep(MoveOnce());
      SolveAgain(step, terms_);
    }
  }

  void Slide(const ScheduleStep& step, const TangentDistanceRelaxation& chosen) {
    const std::vector<Term> terms =
        AsTangentPoints(terms_, chosen.tangential, result_.levels.back().auto_weight);
    for (int round = 0; round < chosen.tangent_rounds; ++round) {
      SolveAgain(step, terms);
      Keep(MoveOnce());
      result_.levels.back().rms_after_mm = rms_mm_;
    }
  }

  bool IsFrozen() const { return std::holds_alternative<FrozenFeatures>(options_.features); }

  LevelView View(int level, const FitTarget& target) const {
    return ViewOf(level, result_.surface, rest_, target, options_.aim, held_);
  }

  LevelSummary Solve(const ScheduleStep& step, std::span<const Term> terms) {
    LevelView view = View(step.level, target());
    const std::vector<int> stay = IsFrozen() ? view.held : std::vector<int>();
    LevelSolution solution = FitLevel(std::move(view), terms, options_.solver);
    LevelSummary summary = std::move(solution.summary);
    summary.level = step.level;
    summary.fraction = step.fraction;
    summary.max_move_mm = WriteBack(std::move(solution.net), step, stay, result_.surface);
    summary.rms_before_mm = rms_mm_;
    rms_mm_ = summary.rms_after_mm = PointRms(result_.surface, target());
    return summary;
  }

  // As a part of the last step.
  void SolveAgain(const ScheduleStep& step, std::span<const Term> terms) {
    const double rms_before_mm = result_.levels.back().rms_before_mm;
    result_.levels.back() = Solve(step, terms);
    result_.levels.back().rms_before_mm = rms_before_mm;
  }

  RelaxationSummary MoveOnce() {
    NetworkMoves once = *moves_;
    once.rounds = 1;
    return Move(once);
  }

  RelaxationSummary Move(const NetworkMoves& moves) {
    const RelaxationSummary summary = Relax(result_.surface, rest_, *mesh_, moves, moved_);
    rms_mm_ = PointRms(result_.surface, moved_);
    return summary;
  }

  RelaxationSummary MoveJointly(const ScheduleStep& step) {
    std::vector<Term> terms = terms_;
    if (const int automatic = AutoTerm(terms); automatic >= 0) {
      SetWeight(result_.levels.back().auto_weight, terms[automatic]);
    }
    const bool detail =
        options_.aim == FitAim::kSurface && step.level < result_.surface.shape().max_level;
    const JointLevel level{
        .view = View(step.level, moved_),
        .terms = terms,
        .detail = detail ? &result_.surface : nullptr,
        .level = step.level,
        .cost = [&](const FitTarget& target) {
          return SumOfCosts(FitLevel(View(step.level, target), terms, options_.solver).summary);
        }};
    return RelaxJointly(result_.surface, rest_, *mesh_, *moves_, level, moved_);
  }

  // As a part of the last step's.
  void Keep(const RelaxationSummary& next) {
    RelaxationSummary& all = result_.relaxations.back();
    all.before = std::isnan(all.before.distance) ? next.before : all.before;
    all.after = next.after;
    all.max_move_mm = std::max(all.max_move_mm, next.max_move_mm);
    all.flips_prevented += next.flips_prevented;
    all.steps_shortened += next.steps_shortened;
  }

  const HSplineSurface& rest_;
  const FitTarget& given_;
  const FitOptions& options_;
  std::vector<Term> terms_;
  std::set<VertexId> held_;  // features that resist
  double most_steps_;
  const RunContext& context_;
  FitResult& result_;
  double rms_mm_;
  std::optional<NetworkMoves> moves_;
  FitTarget moved_;  // the points as relaxation has left them; unused without
  std::optional<DowelMesh> mesh_;
};

}  // namespace

FitResult Fit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& given,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context) {
  CheckFit(start, rest, given, features, options);
  if (std::holds_alternative<AdaptivePlan>(options.plan)) {
    FitResult result = FitAdaptively(start, rest, given, options, context);
    if (std::holds_alternative<RestoreFeatures>(options.features) && !features.empty()) {
      result.restored_features = RestoreTemplateFeatures(rest, features, result.surface);
      MeasureAnew(given, result);
    }
    return result;
  }
  FitResult result{.surface = start};
  const std::vector<ScheduleStep> steps = StepsOf(options), sweep = SweepOf(steps);
  const auto* const until = std::get_if<UntilPlan>(&options.plan);
  const int passes = until == nullptr ? 1 : until->max_passes;
  Fitter fitter(rest, given, features, options,
                passes * steps.size() + options.sweeps * sweep.size(), context, result);
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
  const bool restore = std::holds_alternative<RestoreFeatures>(options.features);
  result.restored_features =
      restore ? RestoreTemplateFeatures(rest, features, result.surface) : fitter.frozen();
  MeasurePoints(fitter.target(), restore && !features.empty() ? kNaN : fitter.rms_mm(), result);
  return result;
}

FitResult Fit(const HSplineSurface& start, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context) {
  return Fit(start, start, target, features, options, context);
}

}  // namespace semblance
