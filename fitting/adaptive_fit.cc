// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/adaptive_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "fitting/auto_weight.h"
#include "fitting/robust_loss.h"
#include "fitting/seeding.h"
#include "fitting/sparse_factor.h"
#include "fitting/tree_system.h"
#include "surfaces/error.h"

namespace semblance {
namespace {

constexpr int kMostIterations = 50;
// What a step moves the surface, root mean square, of the size of the net of level 0. How far it
// moves the unknowns says nothing where a coarse vertex is a sum of finer ones.
constexpr double kConverged = 1e-14;
constexpr double kRoughly = 1e-4;  // while patches are still being overlaid

PointTerm PointsOf(std::span<const Term> terms) {
  std::optional<PointTerm> points;
  for (const Term& term : terms) {
    const double weight = std::visit([](const auto& t) -> double { return t.weight; }, term);
    if (weight <= 0) {
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

Vec2 LengthsOf(const HSplineSurface& rest) {
  const HSplineShape& shape = rest.shape();
  return MeanLengths({.patches_u = shape.patches_u,
                      .patches_v = shape.patches_v,
                      .periodic_u = shape.closure == Closure::kPeriodicU},
                     rest.Net(0));
}

bool WantsSmoothness(std::span<const Term> terms) {
  return std::any_of(terms.begin(), terms.end(), [](const Term& term) {
    return !std::holds_alternative<PointTerm>(term) &&
           std::visit([](const auto& t) -> double { return t.weight; }, term) > 0;
  });
}

class AdaptiveFitter {
 public:
  AdaptiveFitter(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
                 const FitOptions& options, const RunContext& context)
      : rest_(rest),
        given_(target),
        options_(options),
        plan_(std::get<AdaptivePlan>(options.plan)),
        terms_(options.terms),
        auto_term_(AutoTerm(options.terms)),
        points_(PointsOf(options.terms)),
        context_(context),
        cloud_(start.shape(), target),
        tree_(start, rest, cloud_) {
    if (WantsSmoothness(options.terms)) {
      const Vec2 lengths_mm = LengthsOf(rest);
      if (!(lengths_mm.allFinite() && lengths_mm.minCoeff() > 0)) {
        throw InputError(fmt::format(
            "adaptive fit: the template's mean lengths along u and v are {} and {} mm; the "
            "smoothness and membrane terms need one that is more than a point or a line",
            lengths_mm.x(), lengths_mm.y()));
      }
      forms_ = FormsOf(start.shape(), terms_, lengths_mm);
    }
    if (options.relaxation.mode != RelaxationMode::kNone) {
      moved_ = target;
      mesh_.emplace(MeshOf(rest, target, options.relaxation));
    }
  }

  FitResult Run() {
    FitResult result{.surface = rest_};
    Measure();
    for (bool more = true; more;) {
      context_.ThrowIfStopped();
      context_.Report(
          "fit", fmt::format("{} vertices to level {}", tree_.unknowns().size(), tree_.finest()));
      result.levels.push_back(Solve(kRoughly));
      if (mesh_) {
        result.relaxations.push_back(MovePoints());
      }
      const std::vector<VertexId> finer = FinerVertices();
      more = !finer.empty();
      if (more) {
        tree_.Edit(finer);
        Measure();
      }
    }
    settled_ = true;
    Measure();
    result.levels.push_back(Solve(kConverged));
    MeasureCoverage(result.levels.back());
    Finish(result);
    return result;
  }

 private:
  const FitTarget& target() const { return mesh_ ? moved_ : given_; }
  double PointScale() const { return points_.weight / cloud_.weight_sum(); }
  double Rms() const { return std::sqrt(tree_.Squares() / cloud_.weight_sum()); }

  // With a loss: first the distances, then the sums with the weights that follow from them.
  void Measure() {
    if (points_.loss == RobustLoss::kNone) {
      tree_.Measure({}, context_.threads, nullptr);
      return;
    }
    tree_.Measure({}, context_.threads, &squares_);
    rms_mm_ = Rms();
    PointTerm loss = points_;
    loss.loss_width_mm = std::max(loss.loss_width_mm, LeastWidth());
    factors_.resize(squares_.size());
    for (std::size_t k = 0; k < squares_.size(); ++k) {
      factors_[k] = RhoSlope(loss, squares_[k]);
    }
    tree_.Measure(factors_, context_.threads, nullptr);
  }

  // While patches are still to be overlaid, and the surface far from most points: three times their
  // median distance, so that the loss does not take them for outliers.
  double LeastWidth() const {
    if (settled_) {
      return 0;
    }
    std::vector<double> squares = squares_;
    const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    return 3 * std::sqrt(*middle);
  }

  double RmsMm() const { return points_.loss == RobustLoss::kNone ? Rms() : rms_mm_; }

  std::vector<TermCosts> Costs() const {
    std::vector<TermCosts> costs;
    for (const Term& term : terms_) {
      double cost = kNaN;
      if (std::holds_alternative<PointTerm>(term)) {
        cost = PointCost();
      } else if (!forms_.empty()) {
        cost = EnergyOf(tree_, FormsOf(tree_.shape(), std::span(&term, 1), LengthsOf(rest_)));
      }
      costs.push_back({.term = std::string(TermName(term)), .before = cost, .after = kNaN});
    }
    return costs;
  }

  double PointCost() const {
    if (points_.loss == RobustLoss::kNone) {
      return PointScale() * tree_.Squares();
    }
    double sum = 0;
    for (std::size_t k = 0; k < squares_.size(); ++k) {
      sum += cloud_.points()[k].weight * Rho(points_, squares_[k]);
    }
    return PointScale() * sum;
  }

  // By generalised cross-validation at the surface as it stands; around the weight of the last
  // time.
  double ChooseSmoothness() {
    if (auto_term_ < 0) {
      return kNaN;
    }
    std::vector<Term> alone(1, terms_[auto_term_]), others = terms_;
    SetWeight(1, alone[0]);
    SetWeight(0, others[auto_term_]);
    const HSplineShape& shape = tree_.shape();
    const Vec2 lengths_mm = LengthsOf(rest_);
    TreeSystem data = Assemble(tree_, PointScale(), {}),
               smooth = Assemble(tree_, 0, FormsOf(shape, alone, lengths_mm)),
               fixed = Assemble(tree_, 0, FormsOf(shape, others, lengths_mm));
    const WeightChoice choice = ChooseWeight({.points = std::move(data.lower),
                                              .points_right = std::move(data.right),
                                              .smooth = std::move(smooth.lower),
                                              .smooth_right = std::move(smooth.right),
                                              .fixed = std::move(fixed.lower),
                                              .fixed_right = std::move(fixed.right),
                                              .misfit = PointScale() * tree_.Squares(),
                                              .count = static_cast<double>(cloud_.points().size())},
                                             chosen_);
    if (!std::isnan(choice.weight)) {
      chosen_ = choice.weight;
      SetWeight(chosen_, terms_[auto_term_]);
      forms_ = FormsOf(shape, terms_, lengths_mm);
    }
    return chosen_;
  }

  // Gauss-Newton steps, each on the residuals themselves, until they are small.
  LevelSummary Solve(double enough) {
    const double auto_weight = ChooseSmoothness();
    LevelSummary summary{.level = tree_.finest(),
                         .fraction = 1,
                         .terms = Costs(),
                         .rms_before_mm = RmsMm(),
                         .iterations = 0,
                         .max_move_mm = 0,
                         .auto_weight = auto_weight,
                         .solver = "direct",
                         .termination = "no_convergence",
                         .usable = true};
    std::optional<SparseFactor> factor;
    while (summary.iterations < kMostIterations) {
      const double length = Step(factor, summary);
      Measure();
      if (!(length > enough)) {
        summary.termination = summary.usable ? "convergence" : "failure";
        break;
      }
      if (enough == kRoughly && points_.loss == RobustLoss::kNone) {
        summary.termination = "first step";
        break;
      }
    }
    const std::vector<TermCosts> after = Costs();
    for (std::size_t k = 0; k < after.size(); ++k) {
      summary.terms[k].after = after[k].before;
    }
    summary.rms_after_mm = RmsMm();
    return summary;
  }

  // What the points alone determine.
  void MeasureCoverage(LevelSummary& summary) const {
    std::vector<int> counts;
    for (const TreeNode& node : tree_.nodes()) {
      if (node.children < 0) {
        counts.push_back(static_cast<int>(node.range.size()));
      }
    }
    summary.coverage = CoverageOf(std::move(counts));
    const SparseMatrix points = Assemble(tree_, PointScale(), {}).lower;
    summary.uncovered_vertices = 0;
    for (std::size_t k = 0; k < tree_.unknowns().size(); ++k) {
      const bool held = points.coeff(k, k) > 0 || tree_.unknowns()[k].covered;
      summary.uncovered_vertices += held ? 0 : 1;
    }
    summary.rank = NumericalRank(points, cloud_.points().size());
  }

  // Returns how far the surface moved, of its size. The matrix is that of the last step unless a
  // loss changes the weights.
  double Step(std::optional<SparseFactor>& factor, LevelSummary& summary) {
    const TreeSystem system = Assemble(tree_, PointScale(), forms_);
    if (!factor || points_.loss != RobustLoss::kNone) {
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
    const double moved = std::max(step.cwiseProduct(system.right).sum(), 0.0) / points_.weight;
    return std::sqrt(moved) / NetSize();
  }

  double NetSize() const {
    double size = 1e-300;
    int count = 0;
    for (const TreeUnknown& unknown : tree_.unknowns()) {
      size += unknown.vertex.level == 0 ? unknown.value.squaredNorm() : 0;
      count += unknown.vertex.level == 0 ? 1 : 0;
    }
    return std::sqrt(size / count);
  }

  RelaxationSummary MovePoints() {
    const RelaxationSummary summary = Relax(tree_.Surface(), rest_, *mesh_, options_.relaxation,
                                            options_.relaxation.rounds, moved_);
    cloud_ = PointCloud(tree_.shape(), moved_);
    tree_.Rebin();
    Measure();
    return summary;
  }

  // Where a leaf has a point too far off: the vertices over its coarsest ancestor (or itself) that
  // is not wholly overlaid yet.
  std::vector<VertexId> FinerVertices() const {
    const double most = plan_.tolerance_mm * plan_.tolerance_mm;
    std::set<VertexId> finer;
    for (const TreeNode& leaf : tree_.nodes()) {
      if (leaf.children >= 0 || !(leaf.sums.largest > most) ||
          leaf.range.size() < static_cast<std::size_t>(plan_.min_points)) {
        continue;
      }
      for (int level = 0; level <= leaf.patch.level && level < plan_.finest; ++level) {
        const int shift = leaf.patch.level - level;
        const PatchId patch{level, leaf.patch.i >> shift, leaf.patch.j >> shift};
        const std::vector<VertexId> missing = MissingOver(patch);
        finer.insert(missing.begin(), missing.end());
        if (!missing.empty()) {
          break;
        }
      }
    }
    return {finer.begin(), finer.end()};
  }

  // Vertices of the next level on the knots of a patch (and beyond, at a border or by the margin)
  // that are not edited.
  std::vector<VertexId> MissingOver(const PatchId& patch) const {
    const HSplineShape& shape = tree_.shape();
    const int level = patch.level + 1, columns = shape.Columns(level), rows = shape.Rows(level);
    const bool periodic = shape.closure == Closure::kPeriodicU;
    const auto first = [&](int k) { return k == 0 ? 0 : 2 * k + 1; };
    const auto last = [&](int k, int patches) { return 2 * k + (k == patches - 1 ? 4 : 3); };
    const int m = plan_.margin;
    const int i0 = (periodic ? 2 * patch.i + 1 : first(patch.i)) - m,
              i1 = (periodic ? 2 * patch.i + 3 : last(patch.i, shape.PatchesU(patch.level))) + m,
              j0 = std::max(first(patch.j) - m, 0),
              j1 = std::min(last(patch.j, shape.PatchesV(patch.level)) + m, rows - 1);
    std::vector<VertexId> missing;
    for (int j = j0; j <= j1; ++j) {
      for (int i = i0; i <= i1; ++i) {
        if (!periodic && (i < 0 || i >= columns)) {
          continue;
        }
        const VertexId vertex{level, ((i % columns) + columns) % columns, j};
        if (!tree_.IsEdited(vertex)) {
          missing.push_back(vertex);
        }
      }
    }
    return missing;
  }

  void Finish(FitResult& result) {
    result.surface = tree_.Surface();
    tree_.Measure({}, context_.threads, &squares_);
    result.point_rms_mm = Rms();
    result.residual_mm.resize(squares_.size());
    double dowels = 0, weights = 0;
    for (std::size_t k = 0; k < squares_.size(); ++k) {
      result.residual_mm[cloud_.Given(k)] = std::sqrt(squares_[k]);
      if (!IsSeeded(target().points[cloud_.Given(k)])) {
        dowels += cloud_.points()[k].weight * squares_[k];
        weights += cloud_.points()[k].weight;
      }
    }
    result.dowel_rms_mm = weights > 0 ? std::sqrt(dowels / weights) : kNaN;
    result.uv.reserve(squares_.size());
    for (const FitPoint& p : target().points) {
      result.uv.push_back(p.uv);
    }
    result.restored_features = 0;
    result.usable = std::all_of(result.levels.begin(), result.levels.end(),
                                [](const LevelSummary& s) { return s.usable; });
  }

  const HSplineSurface& rest_;
  const FitTarget& given_;
  const FitOptions& options_;
  AdaptivePlan plan_;
  std::vector<Term> terms_;  // with the weight that was chosen last
  int auto_term_;            // among them, or -1
  PointTerm points_;
  const RunContext& context_;
  FitTarget moved_;  // the points as relaxation has left them; unused without
  std::optional<DowelMesh> mesh_;
  PointCloud cloud_;
  OffsetTree tree_;
  std::vector<LevelForms> forms_;  // none without smoothness
  std::vector<double> squares_, factors_;
  double chosen_ = 0;  // weight; 0: none yet
  bool settled_ = false;
  double rms_mm_ = kNaN;  // with a loss: without its factors
};

}  // namespace

FitResult FitAdaptively(const HSplineSurface& start, const HSplineSurface& rest,
                        const FitTarget& target, const FitOptions& options,
                        const RunContext& context) {
  return AdaptiveFitter(start, rest, target, options, context).Run();
}

}  // namespace semblance
