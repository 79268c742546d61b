// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/uncertainty/error_propagation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <utility>
#include <variant>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/solve/space_solve.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::fitting {
namespace {

constexpr Eigen::Index kAtOnce = 64;  // right-hand sides per solve; bounds the memory

bool IsPointTerm(const Term& term) {
  return std::holds_alternative<PointTerm>(term) || std::holds_alternative<LandmarkTerm>(term) ||
         std::holds_alternative<TangentPointTerm>(term);
}

bool TreatsAxesAlike(const Term& term) { return SeparableButForLoss(std::span(&term, 1)); }

// The terms with a positive weight that are not terms of the points.
std::vector<Term> OthersAmong(std::span<const Term> terms) {
  std::vector<Term> others;
  std::copy_if(terms.begin(), terms.end(), std::back_inserter(others),
               [](const Term& term) { return TermWeight(term) > 0 && !IsPointTerm(term); });
  return others;
}

std::vector<std::string_view> LeftOut(std::span<const Term> terms) {
  std::vector<std::string_view> names;
  for (const Term& term : terms) {
    if (!TreatsAxesAlike(term) && !IsPointTerm(term)) {
      names.push_back(TermName(term));
    }
  }
  return names;
}

// The terms that are solved for: tangent_points become points, and other terms that couple x, y and
// z are left out.
std::vector<Term> Solved(std::span<const Term> terms) {
  std::vector<Term> solved;
  for (const Term& term : terms) {
    if (const auto* const tangent = std::get_if<TangentPointTerm>(&term); tangent != nullptr) {
      solved.emplace_back(PointTerm{.weight = tangent->weight});
    } else if (TreatsAxesAlike(term)) {
      solved.push_back(term);
    }
  }
  return solved;
}

void Check(const FitTarget& target, const PointErrors& errors, const std::vector<double>& weights) {
  const std::size_t count = target.points.size();
  if (errors.directions.size() != count || errors.root.rows() != static_cast<Eigen::Index>(count)) {
    throw InputError(
        fmt::format("uncertainty: {} directions and {} rows of errors for {} points; give one each",
                    errors.directions.size(), errors.root.rows(), count));
  }
  if (std::none_of(weights.begin(), weights.end(), [](double w) { return w > 0; })) {
    throw InputError(
        "uncertainty: no point has a weight; the terms need points or tangent_points with one");
  }
}

Eigen::MatrixXd UnitColumns(Eigen::Index rows, Eigen::Index first, Eigen::Index count) {
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(rows, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    unit(first + k, k) = 1;
  }
  return unit;
}

// The points without the detail of levels finer than `level`.
FitTarget LessFiner(const HSplineSurface& surface, const HSplineSurface& rest,
                    const FitTarget& target, int level) {
  const LevelView view = MakeLevelView(surface, rest, target, level);
  FitTarget moved = target;
  moved.anchors.clear();
  for (std::size_t k = 0; k < moved.points.size(); ++k) {
    moved.points[k].position = view.observations[k].position;
  }
  return moved;
}

HSplineSurface UpTo(int level, const HSplineSurface& surface) {
  HSplineShape shape = surface.shape();
  shape.max_level = level;
  HSplineSurface coarse(shape, surface.Net(0));
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const auto& [vertex, offset] : surface.Offsets()) {
    if (vertex.level <= level) {
      offsets.emplace(vertex, offset);
    }
  }
  coarse.SetOffsets(offsets);
  return coarse;
}

// Returns whether only some of the level's vertices are edited.
bool IsFinerSomewhere(const HSplineSurface& surface, int level) {
  const std::size_t edited = surface.Offsets(level).size(),
                    all = static_cast<std::size_t>(surface.Columns(level)) * surface.Rows(level);
  return level > 0 && edited > 0 && edited < all;
}

// Sums A^T z over the rows with random z of unit variance. The covariance of the sum is the rows'
// normal matrix (perturb and solve; Papandreou & Yuille 2010).
class NoiseSink final : public RowSink {
 public:
  NoiseSink(Eigen::Index vertices, Random& random)
      : random_(random), sum_(Eigen::MatrixX3d::Zero(vertices, 3)) {}

  void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 /*b*/,
           std::span<const int> vertices) override {
    Rows3 noise(a->rows(), 3);
    for (Eigen::Index k = 0; k < noise.size(); ++k) {
      noise(k / 3, k % 3) = random_.Normal();
    }
    const Eigen::MatrixX3d pull = a->transpose() * noise;
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      sum_.row(vertices[k]) += pull.row(static_cast<Eigen::Index>(k));
    }
  }
  const Eigen::MatrixX3d& Sum() const { return sum_; }  // vertices x 3

 private:
  Random& random_;
  Eigen::MatrixX3d sum_;
};

}  // namespace

// A point of the surface as a weighted sum of the unknowns.
struct PointRow {
  std::vector<int> index;
  std::vector<double> weight;
  PointRow(const LevelView& view, const Vec2& uv) {
    const DofStencil stencil = view.StencilAt(uv);
    index.assign(stencil.dofs().begin(), stencil.dofs().end());
    weight.assign(stencil.weight.begin(), stencil.weight.begin() + stencil.count);
  }
};

struct ErrorPropagation::Model {
  HSplineSurface surface;
  int level;
  FitTarget target;  // without the detail of finer levels
  bool in_places;
  std::vector<Term> given;
  std::unique_ptr<SpaceSolve> solve;
  std::vector<PointRow> rows = {};             // one per point, in the given order
  std::vector<double> weights = {};            // W, one per point
  std::vector<Term> others = {};               // the terms of P
  SparseMatrix others_normal = {};             // P, lower
  SparseMatrix normal = {};                    // M, lower
  std::unique_ptr<SparseFactor> factor = {};   // factor of M
  std::array<Eigen::MatrixXd, 3> points = {};  // M^-1 A'W root per coordinate, transposed
  Eigen::MatrixXd undone = {};                 // steps not taken: unknowns x 3, mm
  double determined = kNaN;
  double prior_sd = 0;

  Model(const HSplineSurface& fitted, const HSplineSurface& rest, const FitTarget& points_given,
        int fitted_level, std::span<const Term> terms)
      : surface(fitted),
        level(fitted_level),
        target(LessFiner(fitted, rest, points_given, fitted_level)),
        in_places(IsFinerSomewhere(fitted, fitted_level)),
        given(terms.begin(), terms.end()) {
    const std::vector<Term> solved = Solved(terms);
    if (in_places) {
      const HSplineSurface coarse = UpTo(level, fitted), coarse_rest = UpTo(level, rest);
      solve = std::make_unique<AdaptiveSolve>(SpaceProblem{.start = coarse,
                                                           .rest = coarse_rest,
                                                           .target = target,
                                                           .terms = solved,
                                                           .final_loss_width = true});
    } else {
      solve = std::make_unique<LevelSolve>(MakeLevelView(fitted, rest, points_given, level), solved,
                                           Solver::kFastest);
    }
    weights = solve->PointWeights();
    for (const FitPoint& point : target.points) {
      rows.emplace_back(solve->View(), point.uv);
    }
  }

  void Solve(const PointErrors& errors) {
    solve->ChooseSmoothness();
    others = OthersAmong(solve->terms());
    others_normal = solve->System(others).lower;
    NormalSystem system = solve->System(solve->terms());
    normal = std::move(system.lower);
    factor = std::make_unique<SparseFactor>(normal,
                                            1e-11 * std::max(normal.diagonal().maxCoeff(), 1e-12));
    if (!factor->usable()) {
      throw InputError(
          "uncertainty: the normal matrix has no factor; add a prior or smoothness term");
    }
    for (int c = 0; c < 3; ++c) {
      points[c] = factor->Solve(Pull(errors, c)).transpose();
    }
    undone = factor->Solve(system.right);
    determined = Determined();
    prior_sd = determined > 0 ? std::sqrt(CostOfOthers() / (3 * determined)) : 0;
  }

  double CostOfOthers() const {
    const LevelView& view = solve->View();
    double sum = 0;
    for (const Term& term : others) {
      sum += std::visit([&](const auto& t) { return TermCost(t, view, view.start); }, term);
    }
    return sum;
  }

  // A'W times the points' errors along one coordinate.
  Eigen::MatrixXd Pull(const PointErrors& errors, int coordinate) const {
    Eigen::MatrixXd pull = Eigen::MatrixXd::Zero(normal.rows(), errors.root.cols());
    for (std::size_t k = 0; k < weights.size(); ++k) {
      for (std::size_t v = 0; v < rows[k].index.size(); ++v) {
        pull.row(rows[k].index[v]) +=
            weights[k] * rows[k].weight[v] * errors.directions[k][coordinate] * errors.root.row(k);
      }
    }
    return pull;
  }

  // trace(M^-1 A'WA), for kAtOnce points at a time.
  double Determined() const {
    const auto count = static_cast<Eigen::Index>(weights.size());
    double trace = 0;
    for (Eigen::Index begin = 0; begin < count; begin += kAtOnce) {
      const Eigen::Index part = std::min(kAtOnce, count - begin);
      Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(normal.rows(), part);
      for (Eigen::Index k = 0; k < part; ++k) {
        const PointRow& row = rows[begin + k];
        for (std::size_t v = 0; v < row.index.size(); ++v) {
          columns(row.index[v], k) += std::sqrt(weights[begin + k]) * row.weight[v];
        }
      }
      trace += columns.cwiseProduct(factor->Solve(columns)).sum();
    }
    return trace;
  }

  // The variance along the normal from the points' errors and the steps not taken.
  double VarianceOfPoints(const PointRow& row, const Vec3& normal_there) const {
    Eigen::VectorXd along = Eigen::VectorXd::Zero(points[0].rows());
    double left = 0;
    for (std::size_t v = 0; v < row.index.size(); ++v) {
      for (int c = 0; c < 3; ++c) {
        along += row.weight[v] * normal_there[c] * points[c].col(row.index[v]);
        left += row.weight[v] * normal_there[c] * undone(row.index[v], c);
      }
    }
    return along.squaredNorm() + left * left;
  }

  // s' M^-1 P M^-1 s for each row s, for kAtOnce columns of the matrix at a time.
  std::vector<double> VarianceOfOthers(const std::vector<PointRow>& at) const {
    std::vector<std::vector<std::pair<int, int>>> uses(normal.rows());  // row, its entry
    for (std::size_t k = 0; k < at.size(); ++k) {
      for (std::size_t v = 0; v < at[k].index.size(); ++v) {
        uses[at[k].index[v]].emplace_back(static_cast<int>(k), static_cast<int>(v));
      }
    }
    std::vector<double> variances(at.size(), 0);
    for (Eigen::Index begin = 0; begin < normal.rows(); begin += kAtOnce) {
      const Eigen::Index part = std::min(kAtOnce, normal.rows() - begin);
      const Eigen::MatrixXd inverse = factor->Solve(UnitColumns(normal.rows(), begin, part));
      const Eigen::MatrixXd columns =
          factor->Solve(others_normal.selfadjointView<Eigen::Lower>() * inverse);
      for (Eigen::Index column = 0; column < part; ++column) {
        for (const auto& [k, entry] : uses[begin + column]) {
          double sum = 0;
          for (std::size_t v = 0; v < at[k].index.size(); ++v) {
            sum += at[k].weight[v] * columns(at[k].index[v], column);
          }
          variances[k] += at[k].weight[entry] * sum;
        }
      }
    }
    return variances;
  }

  // Returns whether some term determines each unknown of a point.
  bool IsKnown(const PointRow& row, const Eigen::VectorXd& diagonal) const {
    const double least = 1e-12 * diagonal.maxCoeff();
    for (std::size_t v = 0; v < row.index.size(); ++v) {
      if (!(diagonal[row.index[v]] > least) && row.weight[v] != 0) {
        return false;
      }
    }
    return true;
  }

  HSplineSurface After(const Eigen::MatrixX3d& step) const {
    HSplineSurface moved = surface;
    ControlNet net = solve->View().start;
    for (Eigen::Index k = 0; !in_places && k < step.rows(); ++k) {
      net.vertices[k] += step.row(k).transpose();
    }
    moved.SetNet(level, in_places ? solve->SurfaceAfter(step).Net(level) : net);
    return moved;
  }
};

ErrorPropagation::ErrorPropagation(const HSplineSurface& surface, const HSplineSurface& rest,
                                   const FitTarget& target, int level, std::span<const Term> terms,
                                   const PointErrors& errors) {
  auto model = std::make_unique<Model>(surface, rest, target, level, terms);
  Check(target, errors, model->weights);
  model->Solve(errors);
  model_ = std::move(model);
}
ErrorPropagation::~ErrorPropagation() = default;
ErrorPropagation::ErrorPropagation(ErrorPropagation&&) noexcept = default;

std::vector<double> ErrorPropagation::Sigma(std::span<const Vec2> uv,
                                            std::span<const Vec3> normals) const {
  const Model& m = *model_;
  std::vector<PointRow> rows;
  for (const Vec2& at : uv) {
    rows.emplace_back(m.solve->View(), at);
  }
  std::vector<double> sigma = m.VarianceOfOthers(rows);
  const Eigen::VectorXd diagonal = m.normal.diagonal();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    sigma[k] = m.IsKnown(rows[k], diagonal)
                   ? std::sqrt(m.prior_sd * m.prior_sd * std::max(sigma[k], 0.0) +
                               m.VarianceOfPoints(rows[k], normals[k]))
                   : kNaN;
  }
  return sigma;
}

std::vector<HSplineSurface> ErrorPropagation::Samples(int count, std::uint64_t random_seed) const {
  const Model& m = *model_;
  Random random(random_seed);
  std::vector<HSplineSurface> samples;
  for (int sample = 0; sample < count; ++sample) {
    NoiseSink noise(m.normal.rows(), random);
    AddRows(m.others, m.solve->View(), noise);
    Eigen::MatrixXd step = m.prior_sd * m.factor->Solve(noise.Sum()) + random.Normal() * m.undone;
    const Eigen::VectorXd z = Eigen::VectorXd::NullaryExpr(
        m.points[0].rows(), [&](Eigen::Index) { return random.Normal(); });
    for (int c = 0; c < 3; ++c) {
      step.col(c) += m.points[c].transpose() * z;
    }
    samples.push_back(m.After(step));
  }
  return samples;
}

double ErrorPropagation::prior_sd() const { return model_->prior_sd; }
double ErrorPropagation::determined() const { return model_->determined; }
std::vector<std::string_view> ErrorPropagation::left_out() const { return LeftOut(model_->given); }

Eigen::MatrixXd PivotedRoot(Eigen::MatrixXd left, double share) {
  const Eigen::Index n = left.rows();
  Eigen::MatrixXd root(n, n);
  Eigen::Index rank = 0;
  const double enough = n > 0 ? share * left.diagonal().maxCoeff() : 0;
  for (; rank < n; ++rank) {
    Eigen::Index pivot = 0;
    const double largest = left.diagonal().maxCoeff(&pivot);
    if (!(largest > enough)) {
      break;
    }
    root.col(rank) = left.col(pivot) / std::sqrt(largest);
    left.noalias() -= root.col(rank) * root.col(rank).transpose();
  }
  return root.leftCols(rank);
}

}  // namespace semblance::fitting
