// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/level/level_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "fitting/least_squares/normal_equations.h"
#include "fitting/level/auto_weight.h"
#include "fitting/level/level_solver.h"
#include "fitting/level/reweighting.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

bool NeedsFeet(const Term& term) {
  return WeightOf(term) > 0 && (std::holds_alternative<NonPenetrationTerm>(term) ||
                                std::holds_alternative<SpringTerm>(term));
}

bool NeedsExtent(const Term& term) {
  return WeightOf(term) > 0 && (std::holds_alternative<SmoothnessTerm>(term) ||
                                std::holds_alternative<MembraneTerm>(term));
}

void CheckSizes(const LevelView& view) {
  const std::size_t count = static_cast<std::size_t>(view.grid.Columns()) * view.grid.Rows();
  if (view.start.vertices.size() != count || view.rest.vertices.size() != count) {
    throw InputError(fmt::format(
        "level fit: {} vertices at the start and {} in the template for a net of {} x {}; give "
        "nets of the same level of the same shape",
        view.start.vertices.size(), view.rest.vertices.size(), view.grid.Columns(),
        view.grid.Rows()));
  }
}

// Patches are named by their first vertex.
int PatchOf(const PatchGrid& grid, const Vec2& uv) { return grid.StencilAt(uv).index[0]; }

std::vector<int> PointsPerPatch(const LevelView& view) {
  std::vector<int> counts(static_cast<std::size_t>(view.grid.patches_u) * view.grid.patches_v, 0);
  const auto cell = [](double x, int n) { return std::clamp(static_cast<int>(x * n), 0, n - 1); };
  for (const Observation& o : view.observations) {
    ++counts[cell(o.uv.x(), view.grid.patches_u) +
             view.grid.patches_u * cell(o.uv.y(), view.grid.patches_v)];
  }
  return counts;
}

double MaxMove(const ControlNet& a, const ControlNet& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.vertices.size(); ++k) {
    largest = std::max(largest, (a.vertices[k] - b.vertices[k]).norm());
  }
  return largest;
}

// Without a loss the misfit is that of the root mean square, which is known.
double CostOf(const Term& term, const LevelView& view, const ControlNet& net, double rms_mm) {
  const auto* const points = std::get_if<PointTerm>(&term);
  if (points != nullptr && IsSeparable(*points) && !view.observations.empty()) {
    return points->weight * rms_mm * rms_mm;
  }
  return std::visit([&](const auto& t) { return TermCost(t, view, net); }, term);
}

SparseMatrix PointNormal(const LevelView& view) {
  NormalMatrix normal(view.grid);
  AddRows(PointTerm{}, view, normal);
  return normal.Lower();
}

Standing StandingOf(const LevelView& view, std::span<const Term> terms, const ControlNet& net) {
  Standing standing{.rms_mm = ObservationRms(view, net)};
  for (const Term& term : terms) {
    standing.costs.push_back(CostOf(term, view, net, standing.rms_mm));
  }
  return standing;
}

void SortBone(std::vector<BoneObservation>& bone) {
  const auto key = [](const BoneObservation& o) {
    const Vec3 &p = o.point.position, &f = o.foot;
    return std::tuple(o.point.uv.x(), o.point.uv.y(), p.x(), p.y(), p.z(), f.x(), f.y(), f.z(),
                      o.point.weight);
  };
  std::sort(bone.begin(), bone.end(),
            [&](const auto& a, const auto& b) { return key(a) < key(b); });
}

}  // namespace

LevelSolution FitLevel(LevelView view, std::span<const Term> given, LevelSolver solver) {
  CheckSizes(view);
  CheckTerms(view, given);
  SortObservations(view.grid, view.observations);
  SortBone(view.bone);
  double auto_weight = kNaN;
  const std::vector<Term> terms = WithChosenWeight(view, given, auto_weight);
  ControlNet net = view.start;
  SolverOutcome outcome = Minimise(view, terms, solver, net);
  LevelSummary summary =
      SummaryOf(terms, StandingOf(view, terms, view.start), StandingOf(view, terms, net), outcome);
  summary.auto_weight = auto_weight;
  summary.max_move_mm = MaxMove(view.start, net);
  summary.solver =
      solver == LevelSolver::kFastest && SeparableButForLoss(terms) ? "direct" : "ceres";
  NoteCoverage({.points = outcome.points.rows() > 0 ? std::move(outcome.points) : PointNormal(view),
                .count = view.observations.size(),
                .patch_counts = PointsPerPatch(view)},
               summary);
  return {std::move(net), std::move(summary)};
}

void CheckExtent(const Vec2& lengths_mm, std::span<const Term> terms) {
  const bool extent = lengths_mm.allFinite() && lengths_mm.minCoeff() > 0;
  if (!extent && std::any_of(terms.begin(), terms.end(), NeedsExtent)) {
    throw InputError(fmt::format(
        "fit: the template's mean lengths along u and v are {} and {} mm; the smoothness and "
        "membrane terms need a template that is more than a point or a line",
        lengths_mm.x(), lengths_mm.y()));
  }
}

void CheckTerms(const LevelView& view, std::span<const Term> terms) {
  CheckExtent(view.lengths_mm, terms);
  const auto bone = std::find_if(terms.begin(), terms.end(), NeedsFeet);
  if (bone != terms.end() && view.bone.empty()) {
    throw InputError(fmt::format(
        "fit: the term '{}' looks at bone, and no point has a foot on bone; leave it out, or "
        "fit a face to a skull",
        TermName(*bone)));
  }
  const bool landmarks = std::any_of(terms.begin(), terms.end(), [](const Term& term) {
    return WeightOf(term) > 0 && std::holds_alternative<LandmarkTerm>(term);
  });
  if (landmarks && !(view.LandmarkWeightSum() > 0)) {
    throw InputError(
        "fit: the term 'landmarks' looks at standard landmarks, and no point is one; leave "
        "it out, or fit a face to dowels at sites");
  }
}

PatchCoverage CoverageOf(std::vector<int> counts) {
  PatchCoverage coverage{.patches = static_cast<int>(counts.size()), .empty_patches = 0};
  coverage.empty_patches = static_cast<int>(std::erase(counts, 0));
  if (!counts.empty()) {
    const auto upper = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2);
    std::nth_element(counts.begin(), upper, counts.end());
    const int lower = counts.size() % 2 == 1 ? *upper : *std::max_element(counts.begin(), upper);
    coverage.median_patch_points = (*upper + lower) / 2.0;
  }
  return coverage;
}

void SortObservations(const PatchGrid& grid, std::vector<Observation>& observations) {
  std::vector<std::pair<int, int>> order;  // patch, observation
  order.reserve(observations.size());
  for (const Observation& o : observations) {
    order.emplace_back(PatchOf(grid, o.uv), static_cast<int>(order.size()));
  }
  const auto key = [&](const std::pair<int, int>& entry) {
    const Observation& o = observations[entry.second];
    return std::tuple(entry.first, o.uv.x(), o.uv.y(), o.position.x(), o.position.y(),
                      o.position.z(), o.weight);
  };
  std::sort(order.begin(), order.end(), [&](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : key(a) < key(b);
  });
  std::vector<Observation> sorted;
  sorted.reserve(observations.size());
  for (const auto& [patch, index] : order) {
    sorted.push_back(observations[index]);
  }
  observations = std::move(sorted);
}

double ObservationRms(const LevelView& view, const ControlNet& net) {
  double sum = 0, weights = 0;
  for (const Observation& o : view.observations) {
    sum += o.weight * (view.PointAt(o.uv, net) - o.position).squaredNorm();
    weights += o.weight;
  }
  return weights > 0 ? std::sqrt(sum / weights) : kNaN;
}

}  // namespace semblance
