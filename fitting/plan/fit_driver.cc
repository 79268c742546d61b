// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/plan/fit_driver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <type_traits>
#include <utility>

#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/relaxation/joint_relaxation.h"
#include "fitting/solve/auto_weight.h"
#include "fitting/solve/space_solve.h"
#include "surfaces/hspline/feature.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance::fitting {
namespace {

using WeightAndDistance = std::array<double, 2>;

double WeightedRms(std::vector<WeightAndDistance> points) {
  std::sort(points.begin(), points.end());
  double sum = 0, weights = 0;
  for (const auto& [weight, distance] : points) {
    sum += weight * distance * distance;
    weights += weight;
  }
  return weights > 0 ? std::sqrt(sum / weights) : kNaN;
}

std::vector<double> Distances(const HSplineSurface& surface, const FitTarget& target, int threads) {
  constexpr std::size_t kAtOnce = 1 << 16;  // points; bounds the further memory
  const HSplineBatch batch(surface);
  const std::vector<FitPoint>& points = target.points;
  std::vector<double> distances;
  distances.reserve(points.size());
  for (std::size_t begin = 0; begin < points.size(); begin += kAtOnce) {
    std::vector<Vec2> uv;
    for (std::size_t k = begin; k < std::min(begin + kAtOnce, points.size()); ++k) {
      uv.push_back(points[k].uv);
    }
    for (const Vec3& on_surface : batch.Points(uv, threads)) {
      distances.push_back((on_surface - points[distances.size()].position).norm());
    }
  }
  return distances;
}

// The terms with points that may slide along the surface. `weight: auto` keeps its last value.
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

double SumOfCosts(const LevelSummary& summary) {
  double sum = 0;
  for (const TermCosts& term : summary.terms) {
    sum += term.after;
  }
  return sum;
}

// The number of solves of a step after its first.
int CountFurtherSolves(const Relaxation& relaxation) {
  return std::visit(
      []<class R>(const R& chosen) {
        if constexpr (std::is_same_v<R, TangentDistanceRelaxation>) {
          return chosen.rounds + chosen.tangent_rounds;
        } else if constexpr (std::is_same_v<R, NoRelaxation> ||
                             std::is_same_v<R, FootpointRelaxation>) {
          return 0;
        } else {
          return chosen.rounds;
        }
      },
      relaxation);
}

int RestoreTemplateFeatures(const HSplineSurface& rest, std::span<const VertexId> features,
                            HSplineSurface& surface) {
  RestoreFeature(ExtractFeature(rest, "rest", features), features, surface);
  return static_cast<int>(std::set(features.begin(), features.end()).size());
}

}  // namespace

double PointRms(const HSplineSurface& surface, const FitTarget& target, int threads) {
  const std::vector<double> distances = Distances(surface, target, threads);
  std::vector<WeightAndDistance> all;
  all.reserve(distances.size());
  for (std::size_t k = 0; k < distances.size(); ++k) {
    all.push_back({target.points[k].weight, distances[k]});
  }
  return WeightedRms(std::move(all));
}

FitDriver::FitDriver(const HSplineSurface& rest, const FitTarget& target, const FitOptions& options,
                     std::vector<Term> terms, const RunContext& context, FitResult& result)
    : rest_(rest),
      given_(target),
      options_(options),
      terms_(std::move(terms)),
      context_(context),
      result_(result),
      rms_mm_(std::holds_alternative<AdaptivePlan>(options.plan) ||
                      std::holds_alternative<AutoPlan>(options.plan)  // both measure by themselves
                  ? kNaN
                  : PointRms(result.surface, target, context.threads)),
      rounds_(CountFurtherSolves(options.relaxation)),
      moves_(EffectiveMoves(options.relaxation)) {
  if (moves_) {
    moved_ = target;
    mesh_.emplace(MakeNetwork(rest, target, *moves_));
  }
}

void FitDriver::Solve(const FitStep& step) { Solve(step, SolveReport::kFull); }

void FitDriver::Solve(const FitStep& step, SolveReport report) {
  result_.levels.push_back(step.solve(terms_, report));
  rms_mm_ = result_.levels.back().rms_after_mm;
}

void FitDriver::Take(const FitStep& step) {
  Solve(step, rounds_ > 0 ? SolveReport::kNone : SolveReport::kFull);
  if (mesh_) {
    result_.relaxations.emplace_back();
    std::visit([&](const auto& chosen) { RelaxAfter(step, chosen); }, options_.relaxation);
  }
}

void FitDriver::RelaxAfter(const FitStep&, const NoRelaxation&) {}
void FitDriver::RelaxAfter(const FitStep&, const FootpointRelaxation&) {
  AddToLastSummary(MovePoints(*moves_, {}));
}
void FitDriver::RelaxAfter(const FitStep& step, const AlternatingRelaxation&) { Alternate(step); }
void FitDriver::RelaxAfter(const FitStep& step, const TangentDistanceRelaxation& chosen) {
  Alternate(step);
  Slide(step, chosen);
}
void FitDriver::RelaxAfter(const FitStep& step, const JointRelaxation& chosen) {
  for (int round = 0; round < chosen.rounds; ++round) {
    AddToLastSummary(MoveJointly(step));
    SolveAgain(step, terms_, round);
  }
}

void FitDriver::Alternate(const FitStep& step) {
  for (int round = 0; round < moves_->rounds; ++round) {
    AddToLastSummary(MoveOnce(round));
    SolveAgain(step, terms_, round);
  }
}

// Adds the solve to the summary of the last step.
void FitDriver::SolveAgain(const FitStep& step, std::span<const Term> terms, int round) {
  const double rms_before_mm = result_.levels.back().rms_before_mm;
  result_.levels.back() =
      step.solve(terms, IsLast(round) ? SolveReport::kFull : SolveReport::kNone);
  result_.levels.back().rms_before_mm = rms_before_mm;
  rms_mm_ = result_.levels.back().rms_after_mm;
}

void FitDriver::Slide(const FitStep& step, const TangentDistanceRelaxation& chosen) {
  const std::vector<Term> terms =
      AsTangentPoints(terms_, chosen.tangential, result_.levels.back().auto_weight);
  for (int round = chosen.rounds; round < rounds_; ++round) {
    SolveAgain(step, terms, round);
    AddToLastSummary(MoveOnce(round));
    result_.levels.back().rms_after_mm = rms_mm_;
  }
}

RelaxationSummary FitDriver::MoveOnce(int round) {
  NetworkMoves once = *moves_;
  once.rounds = 1;
  return MovePoints(once, {.before = round == 0, .after = IsLast(round)});
}

RelaxationSummary FitDriver::MovePoints(const NetworkMoves& moves,
                                        const MeasuredPenalties& measured) {
  const RelaxationSummary summary = Relax(result_.surface, rest_, *mesh_, moves, moved_, measured);
  rms_mm_ = measured.after ? PointRms(result_.surface, moved_, context_.threads) : kNaN;
  return summary;
}

RelaxationSummary FitDriver::MoveJointly(const FitStep& step) {
  std::vector<Term> terms = terms_;
  if (const int automatic = AutoTerm(terms); automatic >= 0) {
    SetWeight(result_.levels.back().auto_weight, terms[automatic]);
  }
  const bool detail =
      PlanAim(options_.plan) == FitAim::kSurface && step.level < result_.surface.shape().max_level;
  const JointLevel level{
      .view = step.view(moved_),
      .terms = terms,
      .detail = detail ? &result_.surface : nullptr,
      .level = step.level,
      .cost = [&](const FitTarget& target) {
        return SumOfCosts(FitLevel(step.view(target), terms, options_.solver).summary);
      }};
  return RelaxJointly(result_.surface, rest_, *mesh_, *moves_, level, moved_);
}

// Adds the moves to the summary of the last step.
void FitDriver::AddToLastSummary(const RelaxationSummary& next) {
  RelaxationSummary& all = result_.relaxations.back();
  all.before = std::isnan(all.before.distance) ? next.before : all.before;
  all.after = next.after;
  all.max_move_mm = std::max(all.max_move_mm, next.max_move_mm);
  all.flips_prevented += next.flips_prevented;
  all.steps_shortened += next.steps_shortened;
}

void FitDriver::Finish(std::span<const VertexId> features) {
  const bool restore =
      std::holds_alternative<RestoreFeatures>(options_.features) && !features.empty();
  result_.restored_features = 0;
  if (restore) {
    result_.restored_features = RestoreTemplateFeatures(rest_, features, result_.surface);
  } else if (std::holds_alternative<FrozenFeatures>(options_.features)) {
    result_.restored_features = static_cast<int>(std::set(features.begin(), features.end()).size());
  }
  MeasurePoints(/*known=*/!restore);
  result_.usable = std::all_of(result_.levels.begin(), result_.levels.end(),
                               [](const LevelSummary& s) { return s.usable; }) &&
                   std::isfinite(result_.point_rms_mm);
}

// known: whether the surface is still that of the last step, whose RMS is known.
void FitDriver::MeasurePoints(bool known) {
  result_.residual_mm = Distances(result_.surface, target(), context_.threads);
  std::vector<WeightAndDistance> dowels;
  bool seeded = false;
  for (const FitPoint& p : target().points) {
    result_.uv.push_back(p.uv);
    seeded = seeded || p.role == PointRole::kSeed;
  }
  for (std::size_t k = 0; seeded && k < result_.uv.size(); ++k) {
    const FitPoint& p = target().points[k];
    if (p.role != PointRole::kSeed) {
      dowels.push_back({p.weight, result_.residual_mm[k]});
    }
  }
  result_.point_rms_mm = known ? rms_mm_ : PointRms(result_.surface, target(), context_.threads);
  result_.dowel_rms_mm = seeded ? WeightedRms(std::move(dowels)) : result_.point_rms_mm;
}

}  // namespace semblance::fitting
