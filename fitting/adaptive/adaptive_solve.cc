// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/adaptive/adaptive_solve.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "fitting/adaptive/refinement_marking.h"
#include "fitting/adaptive/space_system.h"
#include "fitting/level/auto_weight.h"
#include "fitting/level/reweighting.h"
#include "fitting/terms/robust_loss.h"
#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

double Enough(SolveTolerance until) { return until == SolveTolerance::kTight ? 1e-14 : 1e-4; }

bool IsSmoothness(const Term& term) {
  return std::holds_alternative<SmoothnessTerm>(term) || std::holds_alternative<MembraneTerm>(term);
}

bool WantsSmoothness(std::span<const Term> terms) {
  return std::any_of(terms.begin(), terms.end(),
                     [](const Term& term) { return IsSmoothness(term) && WeightOf(term) > 0; });
}

bool IsPoints(const Term& term) {
  return std::holds_alternative<PointTerm>(term) && WeightOf(term) > 0;
}

PointTerm PointsOf(std::span<const Term> terms) {
  const auto found = std::find_if(terms.begin(), terms.end(), IsPoints);
  return found == terms.end() ? PointTerm{} : std::get<PointTerm>(*found);
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

AdaptiveSolve::AdaptiveSolve(const HSplineSurface& start, const HSplineSurface& rest,
                             const FitTarget& target, std::span<const Term> terms,
                             LevelSolver solver, int threads)
    : target_(target),
      cloud_(start.shape(), target),
      space_(start, rest, cloud_),
      terms_(terms.begin(), terms.end()),
      points_(PointsOf(terms)),
      auto_term_(AutoTerm(terms)),
      solver_(solver),
      threads_(threads),
      lengths_mm_(MeanLengths(rest)) {
  CheckExtent(lengths_mm_, terms);
  Measure();
}

void AdaptiveSolve::SeePoints() {
  cloud_ = PointCloud(space_.shape(), target_);
  space_.Rebin();
  Measure();
}

bool AdaptiveSolve::Refine(const AdaptivePlan& plan) {
  const std::vector<VertexId> finer = MarkForRefinement(space_, plan);
  if (finer.empty()) {
    return false;
  }
  space_.Edit(finer);
  Measure();
  return true;
}

LevelSummary AdaptiveSolve::Settle() {
  settled_ = true;
  Measure();
  LevelSummary summary = Solve(SolveTolerance::kTight);
  std::vector<int> counts;
  for (const QuadtreeNode& node : space_.nodes()) {
    if (node.children < 0) {
      counts.push_back(static_cast<int>(node.range.size()));
    }
  }
  const auto covered = std::count_if(space_.dofs().begin(), space_.dofs().end(),
                                     [](const ControlDof& dof) { return dof.covered; });
  NoteCoverage({.points = Assemble(space_, Scale(), {}).lower,
                .count = cloud_.points().size(),
                .patch_counts = std::move(counts),
                .covered = static_cast<int>(covered)},
               summary);
  return summary;
}

LevelSummary AdaptiveSolve::Solve(SolveTolerance until) {
  const double auto_weight = ChooseSmoothness();
  const bool direct = GoesDirectly();
  const Standing before = Stand();
  max_move_mm_ = 0;
  const SolverOutcome outcome =
      direct ? Descend(*this, terms_,
                       {.relative_shift = 1e-9,
                        .least_move = Enough(until),
                        .reweighted = HasLoss(),
                        .one_step = until == SolveTolerance::kLoose && !HasLoss()})
             : SolveWithCeres(until);
  LevelSummary summary = SummaryOf(terms_, before, Stand(), outcome);
  summary.level = space_.finest();
  summary.fraction = 1;
  summary.max_move_mm = max_move_mm_;
  summary.auto_weight = auto_weight;
  summary.solver = direct ? "direct" : "ceres";
  return summary;
}

// By generalised cross-validation at the surface as it stands; around the weight of the last time.
double AdaptiveSolve::ChooseSmoothness() {
  if (auto_term_ < 0) {
    return kNaN;
  }
  const WeightChoice choice = ChooseWeight(
      *this, {terms_, auto_term_, /*misfit=*/Scale() * space_.Squares(), cloud_.points().size()},
      chosen_);
  if (!std::isnan(choice.weight)) {
    chosen_ = choice.weight;
    SetWeight(chosen_, terms_[auto_term_]);
  }
  return chosen_;
}

bool AdaptiveSolve::GoesDirectly() const {
  return solver_ == LevelSolver::kFastest &&
         std::all_of(terms_.begin(), terms_.end(), [](const Term& term) {
           return WeightOf(term) <= 0 || std::holds_alternative<PointTerm>(term) ||
                  IsSmoothness(term);
         });
}

NormalSystem AdaptiveSolve::System(std::span<const Term> terms) {
  const bool points = std::any_of(terms.begin(), terms.end(), IsPoints);
  std::vector<LevelStiffness> forms;
  if (WantsSmoothness(terms)) {
    forms = StiffnessByLevel(space_.shape(), terms, lengths_mm_);
  }
  return Assemble(space_, points ? Scale() : 0, forms);
}

double AdaptiveSolve::Move(const Eigen::MatrixX3d& step, const Eigen::MatrixX3d& right) {
  Take(step);
  const double moved = std::max(step.cwiseProduct(right).sum(), 0.0) / points_.weight;
  return std::sqrt(moved) / NetSize(space_);
}

void AdaptiveSolve::Take(const Eigen::MatrixX3d& step) {
  space_.Move(step);
  max_move_mm_ = std::max(max_move_mm_, step.rowwise().norm().maxCoeff());
  Measure();
}

SolverOutcome AdaptiveSolve::SolveWithCeres(SolveTolerance until) {
  const LevelView view = View();
  CheckTerms(view, terms_);
  std::vector<Term> terms = terms_;
  for (Term& term : terms) {
    if (auto* const points = std::get_if<PointTerm>(&term); points != nullptr) {
      points->loss_width_mm = std::max(points->loss_width_mm, LeastLossWidth_mm());
    }
  }
  ControlNet net = view.start;
  const SolverOutcome outcome = Minimise(view, terms, LevelSolver::kCeres, net,
                                         until == SolveTolerance::kTight ? 1e-12 : Enough(until));
  Take(view.space->StepTo(net));
  return outcome;
}

Standing AdaptiveSolve::Stand() const {
  Standing standing{.rms_mm = Rms()};
  std::optional<LevelView> view;
  for (const Term& term : terms_) {
    if (std::holds_alternative<PointTerm>(term)) {
      standing.costs.push_back(WeightOf(term) > 0 ? PointCost() : 0);
    } else if (IsSmoothness(term)) {
      const auto forms = StiffnessByLevel(space_.shape(), std::span(&term, 1), lengths_mm_);
      standing.costs.push_back(WantsSmoothness(terms_) ? EnergyOf(space_, forms) : kNaN);
    } else {
      if (!view) {
        view = View();
      }
      standing.costs.push_back(
          std::visit([&](const auto& t) { return TermCost(t, *view, view->start); }, term));
    }
  }
  return standing;
}

// With a loss: first the distances, then the sums with the weights that follow from them.
void AdaptiveSolve::Measure() {
  if (!HasLoss()) {
    space_.Measure({}, threads_, nullptr);
    return;
  }
  space_.Measure({}, threads_, &squares_);
  rms_mm_ = std::sqrt(space_.Squares() / cloud_.weight_sum());
  PointTerm loss = points_;
  loss.loss_width_mm = std::max(loss.loss_width_mm, LeastLossWidth_mm());
  factors_.resize(squares_.size());
  for (std::size_t k = 0; k < squares_.size(); ++k) {
    factors_[k] = RhoSlope(loss, squares_[k]);
  }
  space_.Measure(factors_, threads_, nullptr);
}

double AdaptiveSolve::LeastLossWidth_mm() const {
  if (settled_ || !HasLoss()) {
    return 0;
  }
  std::vector<double> squares = squares_;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return 3 * std::sqrt(*middle);
}

double AdaptiveSolve::Rms() const {
  return HasLoss() ? rms_mm_ : std::sqrt(space_.Squares() / cloud_.weight_sum());
}

double AdaptiveSolve::PointCost() const {
  if (!HasLoss()) {
    return Scale() * space_.Squares();
  }
  double sum = 0;
  for (std::size_t k = 0; k < squares_.size(); ++k) {
    sum += cloud_.points()[k].weight * Rho(points_, squares_[k]);
  }
  return Scale() * sum;
}

}  // namespace semblance
