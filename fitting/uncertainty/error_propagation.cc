// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/uncertainty/error_propagation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>
#include <variant>

#include "fitting/least_squares/noise_sink.h"
#include "fitting/least_squares/normal_equations.h"
#include "fitting/level/auto_weight.h"
#include "fitting/level/reweighting.h"
#include "fitting/terms/level_view.h"
#include "fitting/terms/term_cost.h"
#include "fitting/uncertainty/subspace.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance {
namespace {

constexpr Eigen::Index kAtOnce = 64;  // right-hand sides, to bound the memory

bool IsOfPoints(const Term& term) {
  return std::holds_alternative<PointTerm>(term) || std::holds_alternative<LandmarkTerm>(term) ||
         std::holds_alternative<TangentPointTerm>(term);
}

bool IsOfRows(const Term& term) {
  return std::visit([]<class T>(const T&) { return RowTerm<T>; }, term);
}

// The terms with a weight that are not of the points, and are rows.
std::vector<Term> OthersAmong(std::span<const Term> terms) {
  std::vector<Term> others;
  std::copy_if(terms.begin(), terms.end(), std::back_inserter(others), [](const Term& term) {
    return WeightOf(term) > 0 && IsOfRows(term) && !IsOfPoints(term);
  });
  return others;
}

double CostOf(std::span<const Term> terms, const LevelView& view) {
  double sum = 0;
  for (const Term& term : terms) {
    sum += std::visit([&](const auto& t) { return TermCost(t, view, view.start); }, term);
  }
  return sum;
}

std::vector<std::string_view> LeftOut(std::span<const Term> terms) {
  std::vector<std::string_view> names;
  for (const Term& term : terms) {
    if (WeightOf(term) > 0 && !IsOfRows(term) && !IsOfPoints(term)) {
      names.push_back(TermName(term));
    }
  }
  return names;
}

// The terms with numbers for `weight: auto`, which is chosen as if the points had no loss and no
// term coupled x, y and z.
std::vector<Term> WithNumbers(std::span<const Term> given, const LevelView& view) {
  std::vector<Term> terms(given.begin(), given.end());
  const int chosen = AutoTerm(terms);
  if (chosen < 0) {
    return terms;
  }
  std::vector<Term> plain = terms;
  for (Term& term : plain) {
    std::visit(
        []<class T>(T& t) {
          if constexpr (std::is_same_v<T, PointTerm>) {
            t.loss = RobustLoss::kNone;
          } else if constexpr (!RowTerm<T>) {
            t.weight = 0;
          }
        },
        term);
  }
  double weight = kNaN;
  terms[chosen] = WithChosenWeight(view, plain, weight)[chosen];
  return terms;
}

void Check(const LevelView& view, const PointErrors& errors, const std::vector<double>& weights) {
  const std::size_t count = view.observations.size();
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

}  // namespace

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

namespace {

double Sum(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) {
    sum += value;
  }
  return sum;
}

// All rows: the points as one term at the weights that they have in the cost.
void AddAll(std::span<const Term> terms, const LevelView& view, const std::vector<double>& weights,
            RowSink& sink) {
  LevelView points = view;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    points.observations[k].weight = weights[k];
  }
  AddRows(PointTerm{.weight = Sum(weights)}, points, sink);
  AddRows(OthersAmong(terms), view, sink);
}

SparseMatrix NormalOf(const LevelView& view, const auto& add_rows) {
  NormalMatrix matrix(view.grid);
  add_rows(matrix);
  return matrix.Lower();
}

// A'W times the points' errors along one coordinate.
Eigen::MatrixXd Pull(const LevelView& view, const std::vector<double>& weights,
                     const PointErrors& errors, int coordinate) {
  Eigen::MatrixXd pull = Eigen::MatrixXd::Zero(view.start.vertices.size(), errors.root.cols());
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const Stencil s = view.grid.StencilAt(view.observations[k].uv);
    for (int v = 0; v < 16; ++v) {
      pull.row(s.index[v]) +=
          weights[k] * s.weight[v] * errors.directions[k][coordinate] * errors.root.row(k);
    }
  }
  return pull;
}

// trace(M^-1 A'WA), a point at a time.
double Determined(const LevelView& view, const std::vector<double>& weights,
                  const SubspaceSolver& factor) {
  const auto count = static_cast<Eigen::Index>(weights.size());
  const auto vertices = static_cast<Eigen::Index>(view.start.vertices.size());
  double trace = 0;
  for (Eigen::Index begin = 0; begin < count; begin += kAtOnce) {
    const Eigen::Index part = std::min(kAtOnce, count - begin);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(vertices, part);
    for (Eigen::Index k = 0; k < part; ++k) {
      const Stencil s = view.grid.StencilAt(view.observations[begin + k].uv);
      for (int v = 0; v < 16; ++v) {
        rows(s.index[v], k) += std::sqrt(weights[begin + k]) * s.weight[v];
      }
    }
    trace += rows.cwiseProduct(factor.Solve(rows)).sum();
  }
  return trace;
}

}  // namespace

struct ErrorPropagation::Model {
  HSplineSurface surface;
  int level;
  LevelView view;
  std::vector<Term> terms;
  std::vector<double> weights;                 // of the points, in the cost
  std::vector<Term> others;                    // of the terms, those that make P
  SparseMatrix others_normal;                  // P, lower
  SparseMatrix normal;                         // M, lower
  SubspaceSolver factor;                       // of M
  std::array<Eigen::MatrixXd, 3> points = {};  // M^-1 A'W root of each coordinate, transposed
  Eigen::MatrixXd undone = {};                 // vertices x 3, mm
  double determined = kNaN;
  double prior_sd = 0;

  Model(const HSplineSurface& fitted, const HSplineSurface& rest, const FitTarget& target,
        int fitted_level, std::span<const Term> given)
      : surface(fitted),
        level(fitted_level),
        view(ViewOfLevel(fitted, rest, target, fitted_level)),
        terms(WithNumbers(given, view)),
        weights(CostWeights(view, terms, view.start)),
        others(OthersAmong(terms)),
        others_normal(NormalOf(view, [&](RowSink& sink) { AddRows(others, view, sink); })),
        normal(NormalOf(view, [&](RowSink& sink) { AddAll(terms, view, weights, sink); })),
        factor(normal, SubspaceBasis(fitted, fitted_level)) {}

  void Solve(const PointErrors& errors) {
    for (int c = 0; c < 3; ++c) {
      points[c] = factor.Solve(Pull(view, weights, errors, c)).transpose();
    }
    NormalResidual residual(view.start);
    AddAll(terms, view, weights, residual);
    undone = factor.Solve(residual.Sum());
    determined = Determined(view, weights, factor);
    prior_sd = determined > 0 ? std::sqrt(CostOf(others, view) / (3 * determined)) : 0;
  }

  std::vector<char> Touched() const {
    const Eigen::VectorXd diagonal = normal.diagonal();
    std::vector<char> touched;
    for (const double d : diagonal) {
      touched.push_back(d > 1e-12 * diagonal.maxCoeff() ? 1 : 0);
    }
    return touched;
  }

  // Of the points' errors and of what is undone, along the normal.
  double VarianceOfPoints(const Stencil& s, const Vec3& normal_there) const {
    Eigen::VectorXd along = Eigen::VectorXd::Zero(points[0].rows());
    double left = 0;
    for (int v = 0; v < 16; ++v) {
      for (int c = 0; c < 3; ++c) {
        along += s.weight[v] * normal_there[c] * points[c].col(s.index[v]);
        left += s.weight[v] * normal_there[c] * undone(s.index[v], c);
      }
    }
    return along.squaredNorm() + left * left;
  }

  // s' M^-1 P M^-1 s of each stencil, a slab of columns of the matrix at a time.
  std::vector<double> VarianceOfOthers(const std::vector<Stencil>& stencils) const {
    std::vector<std::vector<std::pair<int, int>>> uses(normal.rows());  // stencil, its entry
    for (std::size_t k = 0; k < stencils.size(); ++k) {
      for (int v = 0; v < 16; ++v) {
        uses[stencils[k].index[v]].emplace_back(static_cast<int>(k), v);
      }
    }
    std::vector<double> variances(stencils.size(), 0);
    for (Eigen::Index begin = 0; begin < normal.rows(); begin += kAtOnce) {
      const Eigen::Index part = std::min(kAtOnce, normal.rows() - begin);
      const Eigen::MatrixXd inverse = factor.Solve(UnitColumns(normal.rows(), begin, part));
      const Eigen::MatrixXd columns =
          factor.Solve(others_normal.selfadjointView<Eigen::Lower>() * inverse);
      for (Eigen::Index column = 0; column < part; ++column) {
        for (const auto& [k, entry] : uses[begin + column]) {
          const Stencil& s = stencils[k];
          double sum = 0;
          for (int v = 0; v < 16; ++v) {
            sum += s.weight[v] * columns(s.index[v], column);
          }
          variances[k] += s.weight[entry] * sum;
        }
      }
    }
    return variances;
  }
};

ErrorPropagation::ErrorPropagation(const HSplineSurface& surface, const HSplineSurface& rest,
                                   const FitTarget& target, int level, std::span<const Term> terms,
                                   const PointErrors& errors) {
  auto model = std::make_unique<Model>(surface, rest, target, level, terms);
  Check(model->view, errors, model->weights);
  if (!model->factor.usable()) {
    throw InputError(
        "uncertainty: the normal matrix has no factor; add a prior or smoothness term");
  }
  model->Solve(errors);
  model_ = std::move(model);
}
ErrorPropagation::~ErrorPropagation() = default;
ErrorPropagation::ErrorPropagation(ErrorPropagation&&) noexcept = default;

std::vector<double> ErrorPropagation::Sigma(std::span<const Vec2> uv,
                                            std::span<const Vec3> normals) const {
  const Model& m = *model_;
  std::vector<Stencil> stencils;
  for (const Vec2& at : uv) {
    stencils.push_back(m.view.grid.StencilAt(at));
  }
  std::vector<double> sigma = m.VarianceOfOthers(stencils);
  const std::vector<char> touched = m.Touched();
  for (std::size_t k = 0; k < stencils.size(); ++k) {
    const Stencil& s = stencils[k];
    bool known = true;
    for (int v = 0; v < 16; ++v) {
      known = known && (touched[s.index[v]] != 0 || s.weight[v] == 0);
    }
    sigma[k] = known ? std::sqrt(m.prior_sd * m.prior_sd * std::max(sigma[k], 0.0) +
                                 m.VarianceOfPoints(s, normals[k]))
                     : kNaN;
  }
  return sigma;
}

std::vector<HSplineSurface> ErrorPropagation::Samples(int count, std::uint64_t random_seed) const {
  const Model& m = *model_;
  const auto vertices = static_cast<Eigen::Index>(m.view.start.vertices.size());
  Random random(random_seed);
  std::vector<HSplineSurface> samples;
  for (int sample = 0; sample < count; ++sample) {
    NoiseSink noise(vertices, random);
    AddRows(m.others, m.view, noise);
    Eigen::MatrixXd step = m.prior_sd * m.factor.Solve(noise.Sum()) + random.Normal() * m.undone;
    const Eigen::VectorXd z = Eigen::VectorXd::NullaryExpr(
        m.points[0].rows(), [&](Eigen::Index) { return random.Normal(); });
    for (int c = 0; c < 3; ++c) {
      step.col(c) += m.points[c].transpose() * z;
    }
    ControlNet net = m.view.start;
    for (Eigen::Index k = 0; k < vertices; ++k) {
      net.vertices[k] += step.row(k).transpose();
    }
    samples.push_back(m.surface);
    samples.back().SetNet(m.level, net);
  }
  return samples;
}

double ErrorPropagation::prior_sd() const { return model_->prior_sd; }
double ErrorPropagation::determined() const { return model_->determined; }
std::vector<std::string_view> ErrorPropagation::left_out() const { return LeftOut(model_->terms); }

}  // namespace semblance
