// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/space_solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>
#include <utility>

#include "fitting/solve/auto_weight.h"
#include "fitting/solve/exact_points.h"
#include "fitting/solve/refinement_marking.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance::fitting {
namespace {

// Limits of the iterations, which normally end by their tolerances. Steps converge at once or
// never; reweighting converges linearly.
constexpr int kMaxSteps = 50, kMaxReweightings = 300;

bool IsActive(const Term& term) { return TermWeight(term) > 0; }

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

// The inputs that terms may need.
struct TermInputs {
  Vec2 lengths_mm;
  bool feet = false, landmarks = false, shape = false;
};

void CheckTerms(std::span<const Term> terms, const TermInputs& given) {
  const bool extent = given.lengths_mm.allFinite() && given.lengths_mm.minCoeff() > 0;
  if (!extent && std::any_of(terms.begin(), terms.end(), IsSmoothness)) {
    throw InputError(fmt::format(
        "fit: the template's mean lengths along u and v are {} and {} mm; the smoothness and "
        "membrane terms need a template that is more than a point or a line",
        given.lengths_mm.x(), given.lengths_mm.y()));
  }
  const auto bone = std::find_if(terms.begin(), terms.end(), [](const Term& term) {
    return IsActive(term) && (std::holds_alternative<NonPenetrationTerm>(term) ||
                              std::holds_alternative<SpringTerm>(term));
  });
  if (bone != terms.end() && !given.feet) {
    throw InputError(fmt::format(
        "fit: the term '{}' needs points with a foot on bone, and there are none; leave it out, or "
        "fit a face to a skull",
        TermName(*bone)));
  }
  if (Has<LandmarkTerm>(terms) && !given.landmarks) {
    throw InputError(
        "fit: the term 'landmarks' needs standard landmarks among the points, and there are none; "
        "leave it out, or fit a face to dowels at sites");
  }
  if (Has<PriorShapeTerm>(terms) && !given.shape) {
    throw InputError(
        "fit: the term 'prior_shape' needs a prior's face, and there is none; leave it out, or "
        "write face: prior_then_fit");
  }
}

void CheckNets(const LevelView& view) {
  const std::size_t count = static_cast<std::size_t>(view.grid.Columns()) * view.grid.Rows();
  if (view.start.vertices.size() != count || view.rest.vertices.size() != count) {
    throw InputError(fmt::format(
        "level fit: {} vertices at the start and {} in the template for a net of {} x {}; give "
        "nets of the same level of the same shape",
        view.start.vertices.size(), view.rest.vertices.size(), view.grid.Columns(),
        view.grid.Rows()));
  }
}

bool NeedsRows(std::span<const Term> terms, Solver solver) {
  return solver != Solver::kFastest || !SeparableButForLoss(terms);
}

// Makes the cloud of a view's observations. If no term needs rows of the observations, they are
// then freed: the cloud holds the same data, and an observation has 56 bytes.
PointCloud MakeCloud(std::span<const Term> terms, Solver solver, LevelView& view) {
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

// The root mean square distance of the vertices of level 0 from the origin.
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

SpaceSolve::SpaceSolve(Problem problem)
    : rest_(std::move(problem.rest)),
      cloud_(std::move(problem.cloud)),
      space_(problem.start, rest_, cloud_),
      terms_(problem.terms.begin(), problem.terms.end()),
      threads_(problem.threads),
      lengths_mm_(problem.lengths_mm),
      landmark_weight_(problem.landmark_weight),
      auto_term_(AutoTerm(terms_)),
      solver_(problem.solver),
      final_loss_width_(problem.final_loss_width) {}

LevelSolve::LevelSolve(LevelView level, std::span<const Term> terms, Solver solver)
    : SpaceSolve(Prepare(level, terms, solver)), view_(std::move(level)) {
  CheckTerms(terms_, {.lengths_mm = lengths_mm_,
                      .feet = !view_.bone.empty(),
                      .landmarks = landmark_weight_ > 0,
                      .shape = !view_.likely.empty()});
  MarkStart();
  Measure();
}

// Sorts the observations and bone points of `level`, or frees the observations.
SpaceSolve::Problem LevelSolve::Prepare(LevelView& level, std::span<const Term> terms,
                                        Solver solver) {
  CheckNets(level);
  PointCloud cloud = MakeCloud(terms, solver, level);
  SortBone(level.bone);
  return {.start = HSplineSurface(level.grid.Shape(), level.start),
          .rest = HSplineSurface(level.grid.Shape(), level.rest),
          .cloud = std::move(cloud),
          .terms = terms,
          .solver = solver,
          .lengths_mm = level.lengths_mm,
          .landmark_weight = level.LandmarkWeightSum(),
          .final_loss_width = true};
}

namespace {

double LandmarkWeightSum(const FitTarget& target) {
  double sum = 0;
  for (const FitPoint& point : target.points) {
    sum += point.role == PointRole::kLandmark ? point.weight : 0;
  }
  return sum;
}

}  // namespace

AdaptiveSolve::AdaptiveSolve(const SpaceProblem& problem)
    : SpaceSolve({.start = problem.start,
                  .rest = problem.rest,
                  .cloud = PointCloud(problem.start.shape(), problem.target),
                  .terms = problem.terms,
                  .solver = problem.solver,
                  .threads = problem.threads,
                  .lengths_mm = MeanLengths(problem.rest),
                  .landmark_weight = LandmarkWeightSum(problem.target),
                  .final_loss_width = problem.final_loss_width}),
      target_(problem.target),
      held_(problem.held.begin(), problem.held.end()) {
  const auto& anchors = target_.anchors;
  CheckTerms(terms_, {.lengths_mm = lengths_mm_,
                      .feet = std::any_of(anchors.begin(), anchors.end(),
                                          [](const BoneAnchor& a) { return a.foot.allFinite(); }),
                      .landmarks = landmark_weight_ > 0,
                      .shape = !target_.shape.empty()});
  EditMirrors();
  MarkStart();
  Measure();
}

// The view of an earlier start is no longer valid (invariant 3).
void AdaptiveSolve::MarkStart() {
  SpaceSolve::MarkStart();
  view_.reset();
}

const LevelView& AdaptiveSolve::View() {
  if (!view_) {
    view_ = MakeSpaceView(space_, cloud_, target_, lengths_mm_);
    view_->start = start_;
    view_->held = HeldRows();
  }
  return *view_;
}

bool AdaptiveSolve::IsLandmark(std::size_t k) const {
  return target_.points[cloud_.Given(k)].role == PointRole::kLandmark;
}

std::vector<int> AdaptiveSolve::HeldRows() const {
  std::vector<int> rows;
  for (const VertexId& vertex : held_) {
    if (const int row = space_.FindRow(vertex); row >= 0) {
      rows.push_back(row);
    }
  }
  return rows;
}

void AdaptiveSolve::UpdatePoints() {
  cloud_ = PointCloud(space_.shape(), target_);
  space_.Rebin();
  MarkStart();
  Measure();
}

void AdaptiveSolve::Edit(std::span<const VertexId> vertices) {
  space_.Edit(vertices);
  EditMirrors();
  MarkStart();
  Measure();
}

// With regions the sums lose the factors of a loss here. If nothing is refined they stay so, and
// the first FinalSolve measures again.
bool AdaptiveSolve::Refine(const AdaptivePlan& plan) {
  std::vector<double> squares;
  if (!plan.regions.empty()) {
    space_.Measure({}, threads_, &squares);
  }
  const std::vector<VertexId> finer =
      MarkForRefinement(space_, plan, cloud_, squares, UnmetPlaces());
  if (!finer.empty()) {
    Edit(finer);
  }
  return !finer.empty();
}

std::vector<double> AdaptiveSolve::ExactMisses() const {
  return target_.exact.empty() ? std::vector<double>()
                               : ExactEquations(space_, target_.exact).Misses(space_.Values());
}

double AdaptiveSolve::MissTolerance_mm() const { return 1e-10 * NetSize(space_); }

// The places of exact points that the vertices cannot hold.
std::vector<Vec2> AdaptiveSolve::UnmetPlaces() const {
  std::vector<Vec2> unmet;
  const std::vector<double> misses = ExactMisses();
  for (std::size_t k = 0; k < misses.size(); ++k) {
    if (misses[k] > MissTolerance_mm()) {
      unmet.push_back(target_.exact[k].uv);
    }
  }
  return unmet;
}

// Restores invariant 4.
void AdaptiveSolve::EditMirrors() {
  if (!Has<SymmetryTerm>(terms_)) {
    return;
  }
  std::vector<VertexId> mirrors;
  for (const ControlDof& dof : space_.dofs()) {
    mirrors.push_back(MirrorVertex(space_.shape(), dof.vertex));
  }
  space_.Edit(mirrors);
}

LevelSummary SpaceSolve::FinalSolve(SolveReport report) {
  if (!std::exchange(final_loss_width_, true)) {
    Measure();
  }
  LevelSummary summary = Solve(SolveTolerance::kTight, report);
  if (report == SolveReport::kFull) {
    AddCoverage(summary);
  }
  return summary;
}

LevelSummary SpaceSolve::Solve(SolveTolerance until, SolveReport report) {
  MarkStart();
  const double auto_weight = ChooseSmoothness();
  const CostState before = EvaluateCosts(report);
  const bool direct = solver_ == Solver::kFastest && (IsDirect() || AllLinear(terms_));
  const SolverOutcome outcome = IsDirect() ? SolveByNewton(until)
                                : direct   ? SolveWithOneFactor()
                                           : SolveWithCeres(until);
  if (!outcome.usable) {
    SetUnknowns(start_);
  }
  const CostState after = EvaluateCosts(report);
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

// Adds the coverage and rank of the points with factors 1, without a loss.
void SpaceSolve::AddCoverage(LevelSummary& summary) {
  std::vector<int> counts;
  for (const QuadtreeNode& node : space_.nodes()) {
    if (node.children < 0) {
      counts.push_back(static_cast<int>(node.range.size()));
    }
  }
  summary.coverage = MakeCoverage(counts);
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
                                            .misfit = PointScale() * space_.Squares(),
                                            .count = static_cast<double>(cloud_.points().size())},
                                           chosen_);
  if (std::isnan(choice.weight) && chosen_ <= 0) {
    throw InputError(
        "weight: auto: no weight has a usable solve; give more points than the directions that "
        "they "
        "determine, or give a number");
  }
  chosen_ = std::isnan(choice.weight) ? chosen_ : choice.weight;
  SetWeight(chosen_, terms_[auto_term_]);
  return chosen_;
}

bool SpaceSolve::IsDirect() const { return !NeedsRows(terms_, solver_); }

NormalSystem SpaceSolve::System(std::span<const Term> terms, SystemPart part) {
  std::vector<LevelStiffness> forms;
  if (std::any_of(terms.begin(), terms.end(), IsSmoothness)) {
    forms = StiffnessByLevel(space_.shape(), terms, lengths_mm_);
  }
  const bool points = std::any_of(terms.begin(), terms.end(), IsOfPoints);
  NormalSystem system = Assemble(space_, points ? PointScale() : 0, forms, part);
  std::vector<Term> others;
  std::copy_if(terms.begin(), terms.end(), std::back_inserter(others), [](const Term& term) {
    return IsActive(term) && !IsOfPoints(term) && !IsSmoothness(term);
  });
  if (!others.empty()) {
    AddTermRows(others, View(), space_.Values(), part, system);
  }
  return system;
}

// The shift of the normal matrix. On several levels the proximal shift is too small: finer vertices
// add to coarser ones, so the unknowns are nearly dependent. The value 1e-9 keeps the factor
// usable, and further steps remove its effect on the solution.
double SpaceSolve::DampingShift(const NormalSystem& system) const {
  return HasOneLevel() ? ProximalShift(terms_, space_.rows())
                       : 1e-9 * std::max(system.lower.diagonal().mean(), 1e-300);
}

// Takes damped Gauss-Newton steps; each computes the residuals again, which removes the effect of
// damping and round-off. One Cholesky factor serves all coordinates, and all steps unless a loss
// changes the weights.
SolverOutcome SpaceSolve::SolveByNewton(SolveTolerance until) {
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
  while (outcome.iterations < (loss ? kMaxReweightings : kMaxSteps)) {
    if (outcome.iterations > 0 && loss) {
      system = System(terms_);
    } else if (outcome.iterations > 0) {
      system.right = System(terms_, SystemPart::kRight).right;
    }
    if (!factor || loss) {
      factor.emplace(system.lower, DampingShift(system));
    }
    ++outcome.iterations;
    const Eigen::MatrixX3d step = ComputeStep(*factor, system);
    outcome.usable = factor->usable() && step.allFinite();
    if (!outcome.usable) {
      outcome.termination = "failure";
      break;
    }
    const bool moved = ApplyStep(step, system.right) > least_move;
    if (!moved || (loose && !loss)) {
      outcome.termination = moved ? "first step" : "convergence";
      break;
    }
  }
  return outcome;
}

// The step after which the exact points hold (invariant 6). Empty if the factor is not usable.
Eigen::MatrixX3d SpaceSolve::ComputeStep(const SparseFactor& factor,
                                         const NormalSystem& system) const {
  if (!factor.usable()) {
    return {};
  }
  const Eigen::MatrixX3d step = factor.Solve(system.right);
  return exact().empty()
             ? step
             : ExactEquations(space_, exact()).ConstrainStep(factor, space_.Values(), step);
}

// Applies a step and returns its length relative to the surface's size. For one level this is the
// move of the vertices, so that weakly held vertices must come to rest too. For several levels a
// move of the unknowns means little, because a coarse vertex is nearly a sum of finer ones; there
// the length is the root of the decrease of the cost.
double SpaceSolve::ApplyStep(const Eigen::MatrixX3d& step, const Eigen::MatrixX3d& right) {
  const double moved = SetUnknowns(Moved(space_.Values(), step));
  return HasOneLevel()
             ? moved
             : std::sqrt(std::max(step.cwiseProduct(right).sum(), 0.0) / PointWeight(terms_)) /
                   NetSize(space_);
}

// Sets the unknowns, and returns the length of their move relative to that of all unknowns.
double SpaceSolve::SetUnknowns(const ControlNet& net) {
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

SolverOutcome SpaceSolve::SolveWithOneFactor() {
  ControlNet net = start_;
  const SolverOutcome outcome = SolveCoupled(View(), terms_, net);
  SetUnknowns(net);
  return outcome;
}

SolverOutcome SpaceSolve::SolveWithCeres(SolveTolerance until) {
  if (SeparableButForLoss(terms_) && HasLoss()) {
    return SolveReweighted(until == SolveTolerance::kTight ? 1e-12 : 1e-4);
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
  SetUnknowns(net);
  return outcome;
}

// Iteratively reweighted least squares: solves with the weights that the losses have at the present
// surface, until the surface no longer moves. One point term replaces all terms of the points.
// Because rho(s) is concave for each loss, the cost falls with every step (majorisation; Hunter &
// Lange 2004).
SolverOutcome SpaceSolve::SolveReweighted(double least_move) {
  LevelView view = View();
  const std::vector<Observation> given = view.observations;
  std::vector<Term> terms;
  std::copy_if(terms_.begin(), terms_.end(), std::back_inserter(terms),
               [](const Term& term) { return !IsOfPoints(term); });
  PointTerm& points = std::get<PointTerm>(terms.emplace_back(PointTerm{}));
  SolverOutcome outcome{.termination = "no_convergence"};
  std::vector<double> factors;
  while (outcome.usable && outcome.iterations < kMaxReweightings) {
    // With unchanged weights a further solve would only move what the points do not determine.
    const std::vector<double> before = std::exchange(factors, LossFactors(squares_));
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
    points.weight = PointScale() * view.WeightSum();
    ControlNet net = space_.Values();
    const SolverOutcome step = SolveBlocked(view, terms, net);
    ++outcome.iterations;
    outcome.usable = step.usable;
    outcome.free_vertices = std::max(outcome.free_vertices, step.free_vertices);
    if (SetUnknowns(net) <= least_move || step.free_vertices == 0) {
      outcome.termination = "convergence";
      break;
    }
  }
  outcome.termination = outcome.usable ? outcome.termination : "failure";
  return outcome;
}

SpaceSolve::CostState SpaceSolve::EvaluateCosts(SolveReport report) {
  CostState state{.rms_mm = rms_mm_};
  if (report == SolveReport::kFull) {
    for (const Term& term : terms_) {
      state.costs.push_back(Cost(term));
    }
  }
  return state;
}

double SpaceSolve::Cost(const Term& term) {
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
    return TotalEnergy(space_, StiffnessByLevel(space_.shape(), std::span(&term, 1), lengths_mm_));
  }
  const ControlNet values = space_.Values();
  return std::visit([&](const auto& t) { return TermCost(t, View(), values); }, term);
}

// The factors of a loss follow from the distances, so these are measured first, and then the sums
// with the factors.
void SpaceSolve::Measure() {
  weighed_ = HasLoss() || Has<LandmarkTerm>(terms_);
  space_.Measure({}, threads_, weighed_ ? &squares_ : nullptr);
  rms_mm_ = cloud_.weight_sum() > 0 ? std::sqrt(space_.Squares() / cloud_.weight_sum()) : kNaN;
  if (weighed_) {
    space_.Measure(LossFactors(squares_), threads_, nullptr);
  }
}

// The factor of each point's weight from all terms of the points, relative to PointScale().
std::vector<double> SpaceSolve::LossFactors(const std::vector<double>& squares) const {
  const double all = PointScale() * cloud_.weight_sum(), least_width_mm = LeastLossWidth_mm();
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
        factors[k] += TermWeight(term) / all * LandmarkFactor(k);
      }
    }
  }
  return factors;
}

// The factor that turns a point's weight in PointTerm into that in LandmarkTerm; 0 for other
// points.
double SpaceSolve::LandmarkFactor(std::size_t k) const {
  return IsLandmark(k) ? cloud_.weight_sum() / landmark_weight_ : 0;
}

std::vector<double> SpaceSolve::PointWeights() const {
  const std::vector<double> factors = weighed_ ? LossFactors(squares_) : std::vector<double>();
  std::vector<double> weights(cloud_.points().size(), 0);
  const bool any = std::any_of(terms_.begin(), terms_.end(), IsOfPoints);
  for (std::size_t k = 0; any && k < weights.size(); ++k) {
    weights[cloud_.Given(k)] =
        PointScale() * cloud_.points()[k].weight() * (weighed_ ? factors[k] : 1);
  }
  return weights;
}

// Invariant 5.
double SpaceSolve::LeastLossWidth_mm() const {
  constexpr double kMedians = 3;  // keeps well over half of the points within the loss
  if (final_loss_width_ || !HasLoss() || squares_.empty()) {
    return 0;
  }
  std::vector<double> squares = squares_;
  return kMedians * std::sqrt(UpperMedian(squares));
}

bool SpaceSolve::HasLoss() const {
  return HasActive(terms_, [](const Term& term) {
    const auto* const points = std::get_if<PointTerm>(&term);
    return points != nullptr && !IsSeparable(*points);
  });
}

double SpaceSolve::PointScale() const {
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

LevelSolution FitLevel(LevelView view, std::span<const Term> terms, Solver solver,
                       SolveReport report) {
  LevelSolution solution{.net = view.start, .summary = {}};
  LevelSolve solve(std::move(view), terms, solver);
  solution.summary = solve.FinalSolve(report);
  solution.net.vertices = solve.Values().vertices;
  return solution;
}

namespace {

// Returns true if no term restricts the vertices beyond the points.
bool OnlyPoints(std::span<const Term> terms) {
  return std::ranges::all_of(terms, [](const Term& term) {
    return !IsActive(term) || IsOfPoints(term) || std::holds_alternative<TangentPointTerm>(term);
  });
}

// The largest distance of an observation from the surface at the start.
double LargestMisfit_mm(const LevelView& view) {
  double largest = 0;
  for (const Observation& o : view.observations) {
    largest = std::max(largest, (view.PointAt(o.uv, view.start) - o.position).norm());
  }
  return largest;
}

// Solves again with a hold that draws all vertices towards their start.
LevelSolution SolveHeld(const LevelView& view, std::vector<Term> terms, double weight,
                        Solver solver, SolveReport report) {
  terms.emplace_back(PriorTerm{.weight = weight, .towards = PriorTowards::kStart});
  LevelSolution solution = FitLevel(view, terms, solver, report);
  if (!solution.summary.terms.empty()) {
    solution.summary.terms.pop_back();  // of the hold
  }
  solution.summary.hold = weight;
  return solution;
}

}  // namespace

// Points alone may determine a combination of vertices by differences of almost equal weights, as
// seeds at the centres of all patches do with a wave from vertex to vertex. Least squares then
// moves vertices by metres to remove a misfit of millimetres. The smallest hold is taken, in steps
// of ten, that keeps the vertices within kReach misfits. A reach of 9 is what the shortest wave
// that a net can follow needs: a third of a vertex's move arrives at the surface in each direction.
LevelSolution FitLevelHeld(const LevelView& view, std::span<const Term> terms, Solver solver,
                           SolveReport report) {
  constexpr double kReach = 10, kLeastHold = 1e-7, kMostHold = 1;  // of the terms' weight
  if (!OnlyPoints(terms) || view.observations.empty()) {
    return FitLevel(view, terms, solver, report);
  }
  const double reach_mm = kReach * LargestMisfit_mm(view);
  LevelSolution solution = FitLevel(view, terms, solver, report);
  double weight = 0;
  for (const Term& term : terms) {
    weight += TermWeight(term);
  }
  for (double hold = kLeastHold; solution.summary.max_move_mm > reach_mm && hold <= 1.5 * kMostHold;
       hold *= 10) {
    solution = SolveHeld(view, {terms.begin(), terms.end()}, hold * weight, solver, report);
  }
  return solution;
}

PatchCoverage MakeCoverage(const std::vector<int>& counts) {
  std::vector<double> filled(counts.begin(), counts.end());
  const auto empty = static_cast<int>(std::erase(filled, 0));
  PatchCoverage coverage{.patches = static_cast<int>(counts.size()), .empty_patches = empty};
  if (!filled.empty()) {
    coverage.median_patch_points = Quantile(filled, 0.5);
  }
  return coverage;
}

}  // namespace semblance::fitting
