// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/adaptive/space_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "fitting/level/auto_weight.h"
#include "fitting/level/reweighting.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr int kMostSteps = 50;

double Enough(SolveTolerance until) { return until == SolveTolerance::kTight ? 1e-14 : 1e-4; }

Vec2 LengthsOf(const HSplineSurface& rest) {
  const HSplineShape& shape = rest.shape();
  return MeanLengths({.patches_u = shape.patches_u,
                      .patches_v = shape.patches_v,
                      .periodic_u = shape.closure == Closure::kPeriodicU},
                     rest.Net(0));
}

bool IsSmoothness(const Term& term) {
  return std::holds_alternative<SmoothnessTerm>(term) || std::holds_alternative<MembraneTerm>(term);
}

bool WantsSmoothness(std::span<const Term> terms) {
  return std::any_of(terms.begin(), terms.end(),
                     [](const Term& term) { return IsSmoothness(term) && WeightOf(term) > 0; });
}

// Of the vertices of level 0, root mean square.
double NetSize(const HierarchicalSplineSpace& space) {
  double size = 1e-300;
  int count = 0;
  for (const ControlDof& dof : space.dofs()) {
    size += dof.vertex.level == 0 ? dof.value.squaredNorm() : 0;
    count += dof.vertex.level == 0 ? 1 : 0;
  }
  return std::sqrt(size / count);
}

}  // namespace

PointTerm PointsOf(std::span<const Term> terms) {
  const auto found = std::find_if(terms.begin(), terms.end(), [](const Term& term) {
    return std::holds_alternative<PointTerm>(term) && WeightOf(term) > 0;
  });
  return found == terms.end() ? PointTerm{} : std::get<PointTerm>(*found);
}

SpaceSolver::SpaceSolver(const SpaceProblem& problem, std::span<const Term> terms)
    : problem_(problem),
      terms_(terms.begin(), terms.end()),
      auto_term_(AutoTerm(terms)),
      cloud_(problem.cloud),
      space_(problem.space),
      points_(problem.points),
      lengths_mm_(LengthsOf(problem.rest)) {
  if (!WantsSmoothness(terms)) {
    return;
  }
  if (!(lengths_mm_.allFinite() && lengths_mm_.minCoeff() > 0)) {
    throw InputError(
        fmt::format("adaptive fit: the template's mean lengths along u and v are {} and {} mm; the "
                    "smoothness and membrane terms need one that is more than a point or a line",
                    lengths_mm_.x(), lengths_mm_.y()));
  }
  forms_ = StiffnessByLevel(space_.shape(), terms_, lengths_mm_);
}

// The points in the cloud's order, in which those of a leaf stand together.
LevelView SpaceSolver::View() const {
  const auto elements = std::make_shared<const SplineElements>(space_);
  LevelView view{.grid = {},
                 .start = elements->Values(),
                 .rest = elements->RestValues(),
                 .lengths_mm = lengths_mm_,
                 .observations = {},
                 .space = elements};
  const FitTarget& target = problem_.target;
  view.observations.reserve(cloud_.points().size());
  for (std::size_t k = 0; k < cloud_.points().size(); ++k) {
    const std::size_t given = cloud_.Given(k);
    const Observation& o = view.observations.emplace_back(Observe(target.points[given]));
    if (!target.anchors.empty() && target.anchors[given].foot.allFinite()) {
      view.bone.push_back({o, target.anchors[given].foot, target.anchors[given].direction});
    }
  }
  return view;
}

std::vector<double> SpaceSolver::Costs() const {
  std::vector<double> costs;
  std::optional<LevelView> view;
  for (const Term& term : terms_) {
    if (std::holds_alternative<PointTerm>(term)) {
      costs.push_back(WeightOf(term) > 0 ? points_.Cost() : 0);
    } else if (IsSmoothness(term)) {
      costs.push_back(forms_.empty()
                          ? kNaN
                          : EnergyOf(space_, StiffnessByLevel(space_.shape(), std::span(&term, 1),
                                                              lengths_mm_)));
    } else {
      if (!view) {
        view = View();
      }
      costs.push_back(
          std::visit([&](const auto& t) { return TermCost(t, *view, view->start); }, term));
    }
  }
  return costs;
}

bool SpaceSolver::GoesDirectly() const {
  return problem_.solver == LevelSolver::kFastest &&
         std::all_of(terms_.begin(), terms_.end(), [](const Term& term) {
           return WeightOf(term) <= 0 || std::holds_alternative<PointTerm>(term) ||
                  IsSmoothness(term);
         });
}

// By generalised cross-validation at the surface as it stands; around the weight of the last time.
double SpaceSolver::ChooseSmoothness() {
  if (auto_term_ < 0) {
    return kNaN;
  }
  std::vector<Term> alone(1, terms_[auto_term_]), others = terms_;
  SetWeight(1, alone[0]);
  SetWeight(0, others[auto_term_]);
  const HSplineShape& shape = space_.shape();
  SpaceSystem data = Assemble(space_, points_.Scale(), {}),
              smooth = Assemble(space_, 0, StiffnessByLevel(shape, alone, lengths_mm_)),
              fixed = Assemble(space_, 0, StiffnessByLevel(shape, others, lengths_mm_));
  const WeightChoice choice = ChooseWeight({.points = std::move(data.lower),
                                            .points_right = std::move(data.right),
                                            .smooth = std::move(smooth.lower),
                                            .smooth_right = std::move(smooth.right),
                                            .fixed = std::move(fixed.lower),
                                            .fixed_right = std::move(fixed.right),
                                            .misfit = points_.Scale() * space_.Squares(),
                                            .count = static_cast<double>(cloud_.points().size())},
                                           chosen_);
  if (!std::isnan(choice.weight)) {
    chosen_ = choice.weight;
    SetWeight(chosen_, terms_[auto_term_]);
    forms_ = StiffnessByLevel(shape, terms_, lengths_mm_);
  }
  return chosen_;
}

LevelSummary SpaceSolver::Solve(SolveTolerance until) {
  const double auto_weight = ChooseSmoothness();
  LevelSummary summary{.level = space_.finest(),
                       .fraction = 1,
                       .terms = {},
                       .rms_before_mm = points_.Rms(),
                       .iterations = 0,
                       .max_move_mm = 0,
                       .auto_weight = auto_weight,
                       .termination = "no_convergence",
                       .usable = true};
  const std::vector<double> before = Costs();
  GoesDirectly() ? SolveDirectly(until, summary) : SolveWithCeres(until, summary);
  const std::vector<double> after = Costs();
  for (std::size_t k = 0; k < after.size(); ++k) {
    summary.terms.push_back({std::string(TermName(terms_[k])), before[k], after[k]});
  }
  summary.rms_after_mm = points_.Rms();
  return summary;
}

// Gauss-Newton steps, each on the residuals themselves, until they are small.
void SpaceSolver::SolveDirectly(SolveTolerance until, LevelSummary& summary) {
  summary.solver = "direct";
  std::optional<SparseFactor> factor;
  while (summary.iterations < kMostSteps) {
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
}

void SpaceSolver::SolveWithCeres(SolveTolerance until, LevelSummary& summary) {
  summary.solver = "ceres";
  const LevelView view = View();
  CheckTerms(view, terms_);
  std::vector<Term> terms = terms_;
  for (Term& term : terms) {
    if (auto* const points = std::get_if<PointTerm>(&term); points != nullptr) {
      points->loss_width_mm = std::max(points->loss_width_mm, points_.LeastLossWidth_mm());
    }
  }
  ControlNet net = view.start;
  const bool coupled = !SeparableButForLoss(terms);
  const SolverOutcome outcome =
      coupled ? SolveByCeres(view, terms, net)
      : AllSeparable(terms)
          ? SolveBlocked(view, terms, net)
          : SolveReweighted(view, terms, SolveBlocked, net,
                            until == SolveTolerance::kTight ? 1e-12 : Enough(until));
  const Eigen::MatrixX3d step = view.space->StepTo(net);
  space_.Move(step);
  points_.Measure();
  summary.iterations = outcome.iterations;
  summary.free_vertices = outcome.free_vertices;
  summary.termination = outcome.termination;
  summary.usable = outcome.usable;
  summary.max_move_mm = step.rowwise().norm().maxCoeff();
}

void SpaceSolver::MeasureCoverage(LevelSummary& summary) const {
  std::vector<int> counts;
  for (const QuadtreeNode& node : space_.nodes()) {
    if (node.children < 0) {
      counts.push_back(static_cast<int>(node.range.size()));
    }
  }
  summary.coverage = CoverageOf(std::move(counts));
  const SparseMatrix points = Assemble(space_, points_.Scale(), {}).lower;
  summary.uncovered_vertices = 0;
  for (std::size_t k = 0; k < space_.dofs().size(); ++k) {
    const bool held = points.coeff(k, k) > 0 || space_.dofs()[k].covered;
    summary.uncovered_vertices += held ? 0 : 1;
  }
  summary.rank = NumericalRank(points, cloud_.points().size());
}

// Returns how far the surface moved, of its size. The matrix is that of the last step unless a loss
// changes the weights.
double SpaceSolver::Step(std::optional<SparseFactor>& factor, LevelSummary& summary) {
  const SpaceSystem system = Assemble(space_, points_.Scale(), forms_);
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
  space_.Move(step);
  summary.max_move_mm = std::max(summary.max_move_mm, step.rowwise().norm().maxCoeff());
  const double moved = std::max(step.cwiseProduct(system.right).sum(), 0.0) / points_.weight();
  return std::sqrt(moved) / NetSize(space_);
}

}  // namespace semblance
