// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/adaptive/tree_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "fitting/level/auto_weight.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr int kMostTreeSteps = 50;

double Enough(SolveTolerance until) { return until == SolveTolerance::kTight ? 1e-14 : 1e-4; }

Vec2 LengthsOf(const HSplineSurface& rest) {
  const HSplineShape& shape = rest.shape();
  return MeanLengths({.patches_u = shape.patches_u,
                      .patches_v = shape.patches_v,
                      .periodic_u = shape.closure == Closure::kPeriodicU},
                     rest.Net(0));
}

bool WantsSmoothness(std::span<const Term> terms) {
  return std::any_of(terms.begin(), terms.end(), [](const Term& term) {
    return !std::holds_alternative<PointTerm>(term) && WeightOf(term) > 0;
  });
}

// Of the vertices of level 0, root mean square.
double NetSize(const OffsetTree& tree) {
  double size = 1e-300;
  int count = 0;
  for (const TreeUnknown& unknown : tree.unknowns()) {
    size += unknown.vertex.level == 0 ? unknown.value.squaredNorm() : 0;
    count += unknown.vertex.level == 0 ? 1 : 0;
  }
  return std::sqrt(size / count);
}

}  // namespace

PointTerm PointsOf(std::span<const Term> terms) {
  std::optional<PointTerm> points;
  for (const Term& term : terms) {
    if (WeightOf(term) <= 0) {
      continue;
    }
    const auto* const point = std::get_if<PointTerm>(&term);
    if (point != nullptr && points) {
      throw InputError("adaptive fit: two terms 'points' with a weight; give one");
    }
    if (point != nullptr) {
      points = *point;
    } else if (!std::holds_alternative<SmoothnessTerm>(term) &&
               !std::holds_alternative<MembraneTerm>(term)) {
      throw InputError(
          fmt::format("adaptive fit: the term '{}' is not for all levels at once; leave it out "
                      "(points, smoothness and membrane can stay) or take another plan",
                      TermName(term)));
    }
  }
  if (!points) {
    throw InputError("adaptive fit: no term 'points' with a weight; add one");
  }
  return *points;
}

TreeSolver::TreeSolver(const HSplineSurface& rest, std::span<const Term> terms,
                       const PointCloud& cloud, OffsetTree& tree, RobustPointResiduals& points)
    : terms_(terms.begin(), terms.end()),
      auto_term_(AutoTerm(terms)),
      cloud_(cloud),
      tree_(tree),
      points_(points),
      lengths_mm_(LengthsOf(rest)) {
  if (!WantsSmoothness(terms)) {
    return;
  }
  if (!(lengths_mm_.allFinite() && lengths_mm_.minCoeff() > 0)) {
    throw InputError(
        fmt::format("adaptive fit: the template's mean lengths along u and v are {} and {} mm; the "
                    "smoothness and membrane terms need one that is more than a point or a line",
                    lengths_mm_.x(), lengths_mm_.y()));
  }
  forms_ = FormsOf(tree.shape(), terms_, lengths_mm_);
}

std::vector<TermCosts> TreeSolver::Costs() const {
  std::vector<TermCosts> costs;
  for (const Term& term : terms_) {
    double cost = kNaN;
    if (std::holds_alternative<PointTerm>(term)) {
      cost = points_.Cost();
    } else if (!forms_.empty()) {
      cost = EnergyOf(tree_, FormsOf(tree_.shape(), std::span(&term, 1), lengths_mm_));
    }
    costs.push_back({.term = std::string(TermName(term)), .before = cost, .after = kNaN});
  }
  return costs;
}

// By generalised cross-validation at the surface as it stands; around the weight of the last time.
double TreeSolver::ChooseSmoothness() {
  if (auto_term_ < 0) {
    return kNaN;
  }
  std::vector<Term> alone(1, terms_[auto_term_]), others = terms_;
  SetWeight(1, alone[0]);
  SetWeight(0, others[auto_term_]);
  const HSplineShape& shape = tree_.shape();
  TreeSystem data = Assemble(tree_, points_.Scale(), {}),
             smooth = Assemble(tree_, 0, FormsOf(shape, alone, lengths_mm_)),
             fixed = Assemble(tree_, 0, FormsOf(shape, others, lengths_mm_));
  const WeightChoice choice = ChooseWeight({.points = std::move(data.lower),
                                            .points_right = std::move(data.right),
                                            .smooth = std::move(smooth.lower),
                                            .smooth_right = std::move(smooth.right),
                                            .fixed = std::move(fixed.lower),
                                            .fixed_right = std::move(fixed.right),
                                            .misfit = points_.Scale() * tree_.Squares(),
                                            .count = static_cast<double>(cloud_.points().size())},
                                           chosen_);
  if (!std::isnan(choice.weight)) {
    chosen_ = choice.weight;
    SetWeight(chosen_, terms_[auto_term_]);
    forms_ = FormsOf(shape, terms_, lengths_mm_);
  }
  return chosen_;
}

LevelSummary TreeSolver::Solve(SolveTolerance until) {
  const double auto_weight = ChooseSmoothness();
  LevelSummary summary{.level = tree_.finest(),
                       .fraction = 1,
                       .terms = Costs(),
                       .rms_before_mm = points_.Rms(),
                       .iterations = 0,
                       .max_move_mm = 0,
                       .auto_weight = auto_weight,
                       .solver = "direct",
                       .termination = "no_convergence",
                       .usable = true};
  std::optional<SparseFactor> factor;
  while (summary.iterations < kMostTreeSteps) {
    const double length = Step(factor, summary);
    points_.Measure();
    if (!(length > Enough(until))) {
      summary.termination = summary.usable ? "convergence" : "failure";
      break;
    }
    if (until == SolveTolerance::kLoose && !points_.HasLoss()) {
      summary.termination = "first step";
      break;
    }
  }
  const std::vector<TermCosts> after = Costs();
  for (std::size_t k = 0; k < after.size(); ++k) {
    summary.terms[k].after = after[k].before;
  }
  summary.rms_after_mm = points_.Rms();
  return summary;
}

void TreeSolver::MeasureCoverage(LevelSummary& summary) const {
  std::vector<int> counts;
  for (const TreeNode& node : tree_.nodes()) {
    if (node.children < 0) {
      counts.push_back(static_cast<int>(node.range.size()));
    }
  }
  summary.coverage = CoverageOf(std::move(counts));
  const SparseMatrix points = Assemble(tree_, points_.Scale(), {}).lower;
  summary.uncovered_vertices = 0;
  for (std::size_t k = 0; k < tree_.unknowns().size(); ++k) {
    const bool held = points.coeff(k, k) > 0 || tree_.unknowns()[k].covered;
    summary.uncovered_vertices += held ? 0 : 1;
  }
  summary.rank = NumericalRank(points, cloud_.points().size());
}

// Returns how far the surface moved, of its size. The matrix is that of the last step unless a loss
// changes the weights.
double TreeSolver::Step(std::optional<SparseFactor>& factor, LevelSummary& summary) {
  const TreeSystem system = Assemble(tree_, points_.Scale(), forms_);
  if (!factor || points_.HasLoss()) {
    const double mean = system.lower.diagonal().mean();
    factor.emplace(system.lower, 1e-9 * std::max(mean, 1e-300));
    summary.free_vertices = static_cast<int>((system.lower.diagonal().array() > 0).count());
  }
  ++summary.iterations;
  const Eigen::MatrixX3d step =
      factor->usable() ? Eigen::MatrixX3d(factor->Solve(system.right)) : Eigen::MatrixX3d();
  if (!factor->usable() || !step.allFinite()) {
    summary.usable = false;
    return 0;
  }
  tree_.Move(step);
  summary.max_move_mm = std::max(summary.max_move_mm, step.rowwise().norm().maxCoeff());
  const double moved = std::max(step.cwiseProduct(system.right).sum(), 0.0) / points_.weight();
  return std::sqrt(moved) / NetSize(tree_);
}

}  // namespace semblance
