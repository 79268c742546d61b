// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/space_solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

#include "fitting/solve/auto_weight.h"
#include "fitting/solve/coupled_solver.h"
#include "fitting/solve/exact_points.h"
#include "fitting/solve/refinement_marking.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

constexpr int kMostSteps = 50, kMostReweightings = 300;

bool IsActive(const Term& term) { return WeightOf(term) > 0; }

bool IsSmoothness(const Term& term) {
  return IsActive(term) && (std::holds_alternative<SmoothnessTerm>(term) ||
                            std::holds_alternative<MembraneTerm>(term));
}

bool IsOfPoints(const Term& term) {
  return IsActive(term) &&
         (std::holds_alternative<PointTerm>(term) || std::holds_alternative<LandmarkTerm>(term));
}

bool HasActive(std::span<const Term> terms, const auto& wanted) {
  return std::any_of(terms.begin(), terms.end(),
                     [&](const Term& term) { return IsActive(term) && wanted(term); });
}

template <class T>
bool Has(std::span<const Term> terms) {
  return HasActive(terms, [](const Term& term) { return std::holds_alternative<T>(term); });
}

// What a space or a level has for its terms to look at.
struct InSight {
  Vec2 lengths_mm;
  bool feet = false, landmarks = false, shape = false;
};

void CheckTerms(std::span<const Term> terms, const InSight& sight) {
  const bool extent = sight.lengths_mm.allFinite() && sight.lengths_mm.minCoeff() > 0;
  if (!extent && std::any_of(terms.begin(), terms.end(), IsSmoothness)) {
    throw InputError(fmt::format(
        "fit: the template's mean lengths along u and v are {} and {} mm; the smoothness and "
        "membrane terms need a template that is more than a point or a line",
        sight.lengths_mm.x(), sight.lengths_mm.y()));
  }
  const auto bone = std::find_if(terms.begin(), terms.end(), [](const Term& term) {
    return IsActive(term) && (std::holds_alternative<NonPenetrationTerm>(term) ||
                              std::holds_alternative<SpringTerm>(term));
  });
  if (bone != terms.end() && !sight.feet) {
    throw InputError(fmt::format(
        "fit: the term '{}' looks at bone, and no point has a foot on bone; leave it out, or "
        "fit a face to a skull",
        TermName(*bone)));
  }
  if (Has<LandmarkTerm>(terms) && !sight.landmarks) {
    throw InputError(
        "fit: the term 'landmarks' looks at standard landmarks, and no point is one; leave "
        "it out, or fit a face to dowels at sites");
  }
  if (Has<PriorShapeTerm>(terms) && !sight.shape) {
    throw InputError(
        "fit: the term 'prior_shape' looks at a prior's face, and there is none; leave it out, or "
        "write face: prior_then_fit");
  }
}

LevelView Checked(LevelView view) {
  const std::size_t count = static_cast<std::size_t>(view.grid.Columns()) * view.grid.Rows();
  if (view.start.vertices.size() != count || view.rest.vertices.size() != count) {
    throw InputError(fmt::format(
        "level fit: {} vertices at the start and {} in the template for a net of {} x {}; give "
        "nets of the same level of the same shape",
        view.start.vertices.size(), view.rest.vertices.size(), view.grid.Columns(),
        view.grid.Rows()));
  }
  return view;
}

bool NeedsRows(std::span<const Term> terms, Solver solver) {
  return solver != Solver::kFastest || !SeparableButForLoss(terms);
}

// A view that no term takes rows of gives its observations away: the cloud says it all, and they
// are 56 bytes each.
PointCloud CloudOf(std::span<const Term> terms, Solver solver, LevelView& view) {
  PointCloud cloud(view.grid.Shape(), view.observations);
  if (NeedsRows(terms, solver) || Has<LandmarkTerm>(terms)) {
    SortObservations(cloud, view.observations);
  } else {
    view.observations = std::vector<Observation>();
  }
  return cloud;
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

ControlNet Moved(ControlNet net, const Eigen::MatrixX3d& step) {
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    net.vertices[k] += step.row(static_cast<Eigen::Index>(k)).transpose();
  }
  return net;
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

SpaceSolve::SpaceSolve(const SpaceProblem& problem)
    : target_(&problem.target),
      rest_(problem.rest),
      cloud_(problem.start.shape(), problem.target),
      space_(problem.start, rest_, cloud_),
      terms_(problem.terms.begin(), problem.terms.end()),
      held_(problem.held.begin(), problem.held.end()),
      auto_term_(AutoTerm(terms_)),
      solver_(problem.solver),
      threads_(problem.threads),
      lengths_mm_(MeanLengths(rest_)),
      settled_(problem.settled) {
  const auto& anchors = problem.target.anchors;
  for (const FitPoint& point : problem.target.points) {
    landmark_weight_ += point.role == PointRole::kLandmark ? point.weight : 0;
  }
  CheckTerms(terms_, {.lengths_mm = lengths_mm_,
                      .feet = std::any_of(anchors.begin(), anchors.end(),
                                          [](const BoneAnchor& a) { return a.foot.allFinite(); }),
                      .landmarks = landmark_weight_ > 0,
                      .shape = !problem.target.shape.empty()});
  EditMirrors();
  Begin();
  Measure();
}

SpaceSolve::SpaceSolve(LevelView level, std::span<const Term> terms, Solver solver)
    : view_(Checked(std::move(level))),
      rest_(view_->grid.Shape(), view_->rest),
      cloud_(CloudOf(terms, solver, *view_)),
      space_(HSplineSurface(view_->grid.Shape(), view_->start), rest_, cloud_),
      terms_(terms.begin(), terms.end()),
      auto_term_(AutoTerm(terms_)),
      solver_(solver),
      lengths_mm_(view_->lengths_mm),
      settled_(true) {
  SortBone(view_->bone);
  landmark_weight_ = view_->LandmarkWeightSum();
  CheckTerms(terms_, {.lengths_mm = lengths_mm_,
                      .feet = !view_->bone.empty(),
                      .landmarks = landmark_weight_ > 0,
                      .shape = !view_->likely.empty()});
  Begin();
  Measure();
}

void SpaceSolve::Begin() {
  start_ = space_.Values();
  if (target_ != nullptr) {
    view_.reset();
  }
}

const LevelView& SpaceSolve::View() {
  if (!view_) {
    view_ = MakeSpaceView(space_, cloud_, *target_, lengths_mm_);
    view_->start = start_;
    view_->held = HeldRows();
  }
  return *view_;
}

void SpaceSolve::SeePoints() {
  cloud_ = PointCloud(space_.shape(), *target_);
  space_.Rebin();
  Begin();
  Measure();
}

bool SpaceSolve::Refine(const AdaptivePlan& plan) {
  std::vector<double> squares;
  if (!plan.regions.empty()) {
    space_.Measure({}, threads_, &squares);
  }
  const std::vector<VertexId> finer = MarkForRefinement(space_, plan, cloud_, squares, Unmet());
  if (finer.empty()) {
    return false;
  }
  space_.Edit(finer);
  EditMirrors();
  Begin();
  Measure();
  return true;
}

void SpaceSolve::AddAsked(int finest) {
  std::vector<FinerPlace> asked;
  for (std::size_t k = 0; HasExact() && k < target_->exact.size(); ++k) {
    if (const ExactPoint& point = target_->exact[k]; point.level > 0) {
      asked.push_back({point.uv, point.level});
    }
  }
  const AdaptivePlan of_places_alone{.tolerance_mm = std::numeric_limits<double>::infinity(),
                                     .finest = finest};
  for (std::vector<VertexId> finer;
       !(finer = MarkForRefinement(space_, of_places_alone, cloud_, {}, asked)).empty();) {
    space_.Edit(finer);
    EditMirrors();
    Begin();
    Measure();
  }
}

std::vector<double> SpaceSolve::ExactMisses() const {
  return HasExact() ? ExactEquations(space_, target_->exact).MissesOf(space_.Values())
                    : std::vector<double>();
}

double SpaceSolve::LeastMiss_mm() const { return 1e-10 * NetSize(space_); }

// Places of exact points that the vertices cannot hold.
std::vector<FinerPlace> SpaceSolve::Unmet() const {
  std::vector<FinerPlace> unmet;
  const std::vector<double> misses = ExactMisses();
  for (std::size_t k = 0; k < misses.size(); ++k) {
    if (misses[k] > LeastMiss_mm()) {
      unmet.push_back({target_->exact[k].uv});
    }
  }
  return unmet;
}

// Then a patch's mirror image is a patch too.
void SpaceSolve::EditMirrors() {
  if (!Has<SymmetryTerm>(terms_)) {
    return;
  }
  std::vector<VertexId> mirrors;
  for (const ControlDof& dof : space_.dofs()) {
    mirrors.push_back(MirrorOf(space_.shape(), dof.vertex));
  }
  space_.Edit(mirrors);
}

LevelSummary SpaceSolve::Settle(SolveReport report) {
  if (!std::exchange(settled_, true)) {
    Measure();
  }
  LevelSummary summary = Solve(SolveTolerance::kTight, report);
  if (report == SolveReport::kFull) {
    NoteCoverage(summary);
  }
  return summary;
}

LevelSummary SpaceSolve::Solve(SolveTolerance until, SolveReport report) {
  Begin();
  const double auto_weight = ChooseSmoothness();
  const Standing before = Stand(report);
  const bool direct = solver_ == Solver::kFastest && (GoesDirectly() || AllLinear(terms_));
  const SolverOutcome outcome = GoesDirectly() ? Descend(until)
                                : direct       ? SolveAtOnce()
                                               : SolveWithCeres(until);
  if (!outcome.usable) {
    Take(start_);
  }
  const Standing after = Stand(report);
  LevelSummary summary{.level = space_.finest(),
                       .fraction = 1,
                       .terms = {},
                       .rms_before_mm = before.rms_mm,
                       .rms_after_mm = after.rms_mm,
                       .iterations = outcome.iterations,
                       .free_vertices = outcome.free_vertices,
                       .max_move_mm = MaxMove(),
                       .auto_weight = auto_weight,
                       .solver = direct ? "direct" : "ceres",
                       .termination = outcome.termination,
                       .usable = outcome.usable};
  for (std::size_t k = 0; k < after.costs.size(); ++k) {
    summary.terms.push_back({std::string(TermName(terms_[k])), before.costs[k], after.costs[k]});
  }
  return summary;
}

// The points as they are given, whatever a loss makes of them.
void SpaceSolve::NoteCoverage(LevelSummary& summary) {
  std::vector<int> counts;
  for (const QuadtreeNode& node : space_.nodes()) {
    if (node.children < 0) {
      counts.push_back(static_cast<int>(node.range.size()));
    }
  }
  summary.coverage = CoverageOf(counts);
  if (weighed_) {
    space_.Measure({}, threads_, nullptr);
  }
  const SparseMatrix points = Assemble(space_, 1, {}).lower;
  summary.uncovered_vertices = static_cast<int>((points.diagonal().array() <= 0).count());
  summary.rank = NumericalRank(points, cloud_.points().size());
  if (weighed_) {
    Measure();
  }
}

double SpaceSolve::ChooseSmoothness() {
  if (auto_term_ < 0) {
    return kNaN;
  }
  std::vector<Term> points, smooth(1, terms_[auto_term_]), others;
  SetWeight(1, smooth[0]);
  for (int k = 0; k < static_cast<int>(terms_.size()); ++k) {
    if (k != auto_term_) {
      (IsOfPoints(terms_[k]) ? points : others).push_back(terms_[k]);
    }
  }
  const WeightChoice choice = ChooseWeight({.points = System(points),
                                            .smooth = System(smooth),
                                            .fixed = System(others),
                                            .misfit = Scale() * space_.Squares(),
                                            .count = static_cast<double>(cloud_.points().size())},
                                           chosen_);
  if (std::isnan(choice.weight) && chosen_ <= 0) {
    throw InputError(
        "weight: auto: no weight has a usable solve; more points than directions they determine "
        "are needed, or give a number");
  }
  chosen_ = std::isnan(choice.weight) ? chosen_ : choice.weight;
  SetWeight(chosen_, terms_[auto_term_]);
  return chosen_;
}

bool SpaceSolve::GoesDirectly() const { return !NeedsRows(terms_, solver_); }

NormalSystem SpaceSolve::System(std::span<const Term> terms, SystemPart part) {
  std::vector<LevelStiffness> forms;
  if (std::any_of(terms.begin(), terms.end(), IsSmoothness)) {
    forms = StiffnessByLevel(space_.shape(), terms, lengths_mm_);
  }
  const bool points = std::any_of(terms.begin(), terms.end(), IsOfPoints);
  NormalSystem system = Assemble(space_, points ? Scale() : 0, forms, part);
  std::vector<Term> others;
  std::copy_if(terms.begin(), terms.end(), std::back_inserter(others), [](const Term& term) {
    return IsActive(term) && !IsOfPoints(term) && !IsSmoothness(term);
  });
  if (!others.empty()) {
    AddRowsOf(others, View(), space_.Values(), part, system);
  }
  return system;
}

std::vector<int> SpaceSolve::HeldRows() const {
  if (target_ == nullptr) {
    return view_->held;
  }
  std::vector<int> rows;
  for (const VertexId& vertex : held_) {
    if (const int row = space_.RowOf(vertex); row >= 0) {
      rows.push_back(row);
    }
  }
  return rows;
}

// Where finer vertices hang on coarser ones, the unknowns are not to keep where they start.
double SpaceSolve::Shift(const NormalSystem& system) const {
  return AloneInItsLevel() ? ProximalShift(terms_, space_.rows())
                           : 1e-9 * std::max(system.lower.diagonal().mean(), 1e-300);
}

// Damped Gauss-Newton steps, each on the residuals themselves, by one Cholesky factor for all
// coordinates and, unless a loss changes the weights, all steps.
SolverOutcome SpaceSolve::Descend(SolveTolerance until) {
  const bool loss = HasLoss(), loose = until == SolveTolerance::kLoose;
  const double least_move = loose ? 1e-4 : loss ? 1e-12 : 1e-13;
  NormalSystem system = System(terms_);
  SolverOutcome outcome{.free_vertices =
                            static_cast<int>((system.lower.diagonal().array() > 0).count())};
  if (outcome.free_vertices == 0) {
    return outcome;
  }
  outcome.termination = "no_convergence";
  std::optional<SparseFactor> factor;
  while (outcome.iterations < (loss ? kMostReweightings : kMostSteps)) {
    if (outcome.iterations > 0 && loss) {
      system = System(terms_);
    } else if (outcome.iterations > 0) {
      system.right = System(terms_, SystemPart::kRight).right;
    }
    if (!factor || loss) {
      factor.emplace(system.lower, Shift(system));
    }
    ++outcome.iterations;
    const Eigen::MatrixX3d step = StepBy(*factor, system);
    outcome.usable = factor->usable() && step.allFinite();
    if (!outcome.usable) {
      outcome.termination = "failure";
      break;
    }
    const bool moved = Move(step, system.right) > least_move;
    if (!moved || (loose && !loss)) {
      outcome.termination = moved ? "first step" : "convergence";
      break;
    }
  }
  return outcome;
}

// Empty by a factor that cannot be used. Exact points hold after it.
Eigen::MatrixX3d SpaceSolve::StepBy(const SparseFactor& factor, const NormalSystem& system) const {
  if (!factor.usable()) {
    return {};
  }
  const Eigen::MatrixX3d step = factor.Solve(system.right);
  return HasExact() ? ExactEquations(space_, target_->exact).Bend(factor, space_.Values(), step)
                    : step;
}

// How far a step takes the surface, of its size. Of a level: by the vertices, so that those which
// are hardly held come to rest too. How far a step moves the unknowns says nothing where a coarse
// vertex is a sum of finer ones; then it is what the step takes off the cost.
double SpaceSolve::Move(const Eigen::MatrixX3d& step, const Eigen::MatrixX3d& right) {
  const double moved = Take(Moved(space_.Values(), step));
  return AloneInItsLevel()
             ? moved
             : std::sqrt(std::max(step.cwiseProduct(right).sum(), 0.0) / PointWeight(terms_)) /
                   NetSize(space_);
}

// Returns the length of the move over that of all unknowns.
double SpaceSolve::Take(const ControlNet& net) {
  const ControlNet from = space_.Values();
  space_.SetValues(net);
  Measure();
  double move = 0, size = 0;
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    move += (net.vertices[k] - from.vertices[k]).squaredNorm();
    size += net.vertices[k].squaredNorm();
  }
  return std::sqrt(move / std::max(size, 1e-26));
}

SolverOutcome SpaceSolve::SolveAtOnce() {
  ControlNet net = start_;
  const SolverOutcome outcome = SolveCoupled(View(), terms_, net);
  Take(net);
  return outcome;
}

SolverOutcome SpaceSolve::SolveWithCeres(SolveTolerance until) {
  if (SeparableButForLoss(terms_) && HasLoss()) {
    return Reweigh(until == SolveTolerance::kTight ? 1e-12 : 1e-4);
  }
  std::vector<Term> terms = terms_;
  for (Term& term : terms) {
    if (auto* const points = std::get_if<PointTerm>(&term); points != nullptr) {
      points->loss_width_mm = std::max(points->loss_width_mm, LeastLossWidth_mm());
    }
  }
  ControlNet net = start_;
  const SolverOutcome outcome = SeparableButForLoss(terms) ? SolveBlocked(View(), terms, net)
                                                           : SolveByCeres(View(), terms, net);
  Take(net);
  return outcome;
}

// Plain least squares with the weights that the losses give, again and again until the surface
// stands still: one term of the points, in place of all, and the others. As rho(s) is concave for
// each loss, the cost falls with every step (majorisation; Hunter & Lange 2004).
SolverOutcome SpaceSolve::Reweigh(double least_move) {
  LevelView view = View();
  const std::vector<Observation> given = view.observations;
  std::vector<Term> terms;
  std::copy_if(terms_.begin(), terms_.end(), std::back_inserter(terms),
               [](const Term& term) { return !IsOfPoints(term); });
  PointTerm& points = std::get<PointTerm>(terms.emplace_back(PointTerm{}));
  SolverOutcome outcome{.termination = "no_convergence"};
  std::vector<double> factors;
  while (outcome.usable && outcome.iterations < kMostReweightings) {
    // The problem of the last time would only creep on where the points determine nothing.
    const std::vector<double> before = std::exchange(factors, FactorsOf(squares_));
    if (factors == before) {
      outcome.termination = "convergence";
      break;
    }
    view.observations.clear();
    for (std::size_t k = 0; k < given.size(); ++k) {
      if (factors[k] > 0) {
        view.observations.push_back(given[k]);
        view.observations.back().weight *= factors[k];
      }
    }
    points.weight = Scale() * view.WeightSum();
    ControlNet net = space_.Values();
    const SolverOutcome step = SolveBlocked(view, terms, net);
    ++outcome.iterations;
    outcome.usable = step.usable;
    outcome.free_vertices = std::max(outcome.free_vertices, step.free_vertices);
    if (Take(net) <= least_move || step.free_vertices == 0) {
      outcome.termination = "convergence";
      break;
    }
  }
  outcome.termination = outcome.usable ? outcome.termination : "failure";
  return outcome;
}

SpaceSolve::Standing SpaceSolve::Stand(SolveReport report) {
  Standing standing{.rms_mm = rms_mm_};
  if (report == SolveReport::kFull) {
    for (const Term& term : terms_) {
      standing.costs.push_back(CostOf(term));
    }
  }
  return standing;
}

double SpaceSolve::CostOf(const Term& term) {
  if (!IsActive(term)) {
    return 0;
  }
  if (const auto* const points = std::get_if<PointTerm>(&term); points != nullptr) {
    double sum = 0;
    for (std::size_t k = 0; !IsSeparable(*points) && k < squares_.size(); ++k) {
      sum += cloud_.points()[k].weight() * Rho(*points, squares_[k]);
    }
    const double mean = IsSeparable(*points) ? rms_mm_ * rms_mm_ : sum / cloud_.weight_sum();
    return cloud_.points().empty() ? 0 : points->weight * mean;
  }
  if (IsSmoothness(term)) {
    return EnergyOf(space_, StiffnessByLevel(space_.shape(), std::span(&term, 1), lengths_mm_));
  }
  const ControlNet values = space_.Values();
  return std::visit([&](const auto& t) { return TermCost(t, View(), values); }, term);
}

// With factors: first the distances, then the sums with the factors that follow from them.
void SpaceSolve::Measure() {
  weighed_ = HasLoss() || Has<LandmarkTerm>(terms_);
  space_.Measure({}, threads_, weighed_ ? &squares_ : nullptr);
  rms_mm_ = cloud_.weight_sum() > 0 ? std::sqrt(space_.Squares() / cloud_.weight_sum()) : kNaN;
  if (weighed_) {
    space_.Measure(FactorsOf(squares_), threads_, nullptr);
  }
}

// Relative to Scale().
std::vector<double> SpaceSolve::FactorsOf(const std::vector<double>& squares) const {
  const double all = Scale() * cloud_.weight_sum(), least_width_mm = LeastLossWidth_mm();
  std::vector<double> factors(squares.size(), 0);
  for (const Term& term : terms_) {
    if (!IsOfPoints(term)) {
      continue;
    }
    if (const auto* const given = std::get_if<PointTerm>(&term); given != nullptr) {
      PointTerm points = *given;
      points.loss_width_mm = std::max(points.loss_width_mm, least_width_mm);
      for (std::size_t k = 0; k < squares.size(); ++k) {
        factors[k] += points.weight / all * RhoSlope(points, squares[k]);
      }
    } else {
      for (std::size_t k = 0; k < squares.size(); ++k) {
        factors[k] += WeightOf(term) / all * LandmarkShare(k);
      }
    }
  }
  return factors;
}

// What a point's weight is multiplied by, to have that of a landmark: 0 of others.
double SpaceSolve::LandmarkShare(std::size_t k) const {
  const bool landmark = target_ != nullptr
                            ? target_->points[cloud_.Given(k)].role == PointRole::kLandmark
                            : view_->observations[k].landmark;
  return landmark ? cloud_.weight_sum() / landmark_weight_ : 0;
}

std::vector<double> SpaceSolve::PointWeights() const {
  const std::vector<double> factors = weighed_ ? FactorsOf(squares_) : std::vector<double>();
  std::vector<double> weights(cloud_.points().size(), 0);
  const bool any = std::any_of(terms_.begin(), terms_.end(), IsOfPoints);
  for (std::size_t k = 0; any && k < weights.size(); ++k) {
    weights[cloud_.Given(k)] = Scale() * cloud_.points()[k].weight() * (weighed_ ? factors[k] : 1);
  }
  return weights;
}

double SpaceSolve::LeastLossWidth_mm() const {
  if (settled_ || !HasLoss() || squares_.empty()) {
    return 0;
  }
  std::vector<double> squares = squares_;
  return 3 * std::sqrt(UpperMedian(squares));
}

bool SpaceSolve::HasLoss() const {
  return HasActive(terms_, [](const Term& term) {
    const auto* const points = std::get_if<PointTerm>(&term);
    return points != nullptr && !IsSeparable(*points);
  });
}

double SpaceSolve::Scale() const {
  const double weight = PointWeight(terms_);
  return cloud_.weight_sum() > 0 ? (weight > 0 ? weight : 1) / cloud_.weight_sum() : 0;
}

double SpaceSolve::MaxMove() const {
  const ControlNet values = space_.Values();
  double largest = 0;
  for (std::size_t k = 0; k < values.vertices.size(); ++k) {
    largest = std::max(largest, (values.vertices[k] - start_.vertices[k]).norm());
  }
  return largest;
}

HSplineSurface SpaceSolve::SurfaceAfter(const Eigen::MatrixX3d& step) const {
  HierarchicalSplineSpace moved = space_;
  moved.SetValues(Moved(moved.Values(), step));
  return moved.Surface();
}

}  // namespace semblance
