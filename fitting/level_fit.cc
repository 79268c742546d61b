// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/level_fit.h"

#include <ceres/solver.h>
#include <dlfcn.h>
#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "fitting/term_cost.h"
#include "surfaces/error.h"

namespace semblance {
namespace {

double WeightOf(const Term& term) {
  return std::visit([](const auto& t) { return t.weight; }, term);
}

double CostOf(const Term& term, const LevelView& view, const ControlNet& net) {
  return std::visit([&](const auto& t) { return TermCost(t, view, net); }, term);
}

bool NeedsExtent(const Term& term) {
  return WeightOf(term) > 0 && (std::holds_alternative<SmoothnessTerm>(term) ||
                                std::holds_alternative<MembraneTerm>(term));
}

void CheckView(const LevelView& view, std::span<const Term> terms) {
  const std::size_t count = static_cast<std::size_t>(view.grid.Columns()) * view.grid.Rows();
  if (view.start.vertices.size() != count || view.rest.vertices.size() != count) {
    throw InputError(fmt::format(
        "level fit: {} vertices at the start and {} in the template for a net of {} x {}; give "
        "nets of the same level of the same shape",
        view.start.vertices.size(), view.rest.vertices.size(), view.grid.Columns(),
        view.grid.Rows()));
  }
  const bool extent = view.lengths_mm.allFinite() && view.lengths_mm.minCoeff() > 0;
  if (!extent && std::any_of(terms.begin(), terms.end(), NeedsExtent)) {
    throw InputError(fmt::format(
        "level fit: the template's mean lengths along u and v are {} and {} mm; the smoothness and "
        "membrane terms need a template that is more than a point or a line",
        view.lengths_mm.x(), view.lengths_mm.y()));
  }
}

// Sums depend on their order: a canonical one makes the result independent of the caller's.
void SortObservations(std::vector<Observation>& observations) {
  const auto key = [](const Observation& o) {
    return std::tuple(o.stencil.index, o.stencil.weight, o.position.x(), o.position.y(),
                      o.position.z(), o.weight);
  };
  std::sort(observations.begin(), observations.end(),
            [&](const Observation& a, const Observation& b) { return key(a) < key(b); });
}

void AddTerms(const LevelView& view, std::span<const Term> terms, ControlNet& net,
              ceres::Problem& problem) {
  for (const Term& term : terms) {
    if (WeightOf(term) > 0) {
      std::visit([&](const auto& t) { AddResiduals(t, view, net, problem); }, term);
    }
  }
}

// What the eigenvalues of the normal equations are measured by: residuals are means over points or
// vertices, so a vertex that is well held has about weight / vertices on the diagonal.
double TypicalStiffness(std::span<const Term> terms, std::size_t vertices) {
  double sum = 0;
  for (const Term& term : terms) {
    sum += WeightOf(term);
  }
  return sum / static_cast<double>(vertices);
}

// Ceres damps by D / radius with D clamped to [min, max]; both at 1 give the identity, and a fixed
// radius the proximal-point iteration x <- argmin cost(y) + |y - x|^2 / radius, which goes to the
// least-squares solution nearest to the start. Damping by the diagonal, Ceres' default, would
// instead move the least-held vertices most. Determined directions converge in two or three steps.
ceres::Solver::Options SolverOptions(double stiffness) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.jacobi_scaling = false;
  options.min_lm_diagonal = options.max_lm_diagonal = 1;
  options.initial_trust_region_radius = std::min(1e8 / stiffness, 1e16);
  options.max_trust_region_radius = options.initial_trust_region_radius;
  options.max_num_iterations = 50;
  options.function_tolerance = 1e-15;
  options.gradient_tolerance = 0;  // blind to weakly determined directions
  options.parameter_tolerance = 1e-13;
  return options;
}

// OpenBLAS, where the sparse Cholesky uses it, sums in an order that depends on its number of
// threads, and so on the machine. One thread gives the same bytes everywhere (and small blocks gain
// nothing from more); looked up at run time, for other BLAS libraries have no such function.
void UseOneBlasThread() {
  static const bool done = [] {
    using SetThreads = void (*)(int);
    void* const symbol = dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
    if (symbol != nullptr) {
      reinterpret_cast<SetThreads>(symbol)(1);
    }
    return true;
  }();
  static_cast<void>(done);
}

std::string Lowercase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

void Solve(const LevelView& view, std::span<const Term> terms, LevelSolution& solution) {
  ceres::Problem problem;
  AddTerms(view, terms, solution.net, problem);
  solution.summary.free_vertices = problem.NumParameterBlocks();
  if (problem.NumParameterBlocks() == 0) {
    solution.summary.iterations = 0;
    solution.summary.termination = "nothing to solve";
    solution.summary.usable = true;
    return;
  }
  UseOneBlasThread();
  ceres::Solver::Summary summary;
  ceres::Solve(SolverOptions(TypicalStiffness(terms, solution.net.vertices.size())), &problem,
               &summary);
  solution.summary.iterations = static_cast<int>(summary.iterations.size()) - 1;
  solution.summary.termination =
      Lowercase(ceres::TerminationTypeToString(summary.termination_type));
  solution.summary.usable = summary.IsSolutionUsable();
  if (!summary.IsSolutionUsable()) {
    solution.net = view.start;
  }
}

using SparseMatrix = Eigen::SparseMatrix<double>;

SparseMatrix ObservationMatrix(const LevelView& view) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < view.observations.size(); ++i) {
    const Stencil& s = view.observations[i].stencil;
    for (int k = 0; k < 16; ++k) {
      entries.emplace_back(static_cast<int>(i), s.index[k], s.weight[k]);
    }
  }
  SparseMatrix matrix(static_cast<int>(view.observations.size()),
                      static_cast<int>(view.start.vertices.size()));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix.pruned(1, 0);
}

int UncoveredVertices(const SparseMatrix& matrix) {
  int uncovered = 0;
  for (int column = 0; column < matrix.cols(); ++column) {
    uncovered += SparseMatrix::InnerIterator(matrix, column) ? 0 : 1;
  }
  return uncovered;
}

// Pivots of the normal equations of the matrix with its columns scaled to 1 (which leaves the rank)
// that stand out of a shift, which keeps the others from being zero. A pivot just above the
// threshold leaves shift / threshold in the next one, so the threshold is above the root of the
// shift.
int NumericalRank(SparseMatrix matrix) {
  for (int column = 0; column < matrix.cols(); ++column) {
    const double norm = matrix.col(column).norm();
    matrix.col(column) *= norm > 0 ? 1 / norm : 0;
  }
  const SparseMatrix normal = matrix.transpose() * matrix;
  Eigen::SimplicialLDLT<SparseMatrix> factor;
  factor.setShift(1e-13);
  factor.compute(normal);
  const auto pivots = static_cast<int>((factor.vectorD().array() > 1e-6).count());
  return std::min(pivots, static_cast<int>(matrix.rows()));
}

double MaxMove(const ControlNet& a, const ControlNet& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.vertices.size(); ++k) {
    largest = std::max(largest, (a.vertices[k] - b.vertices[k]).norm());
  }
  return largest;
}

void Measure(const LevelView& view, std::span<const Term> terms, LevelSolution& solution) {
  LevelSummary& summary = solution.summary;
  for (const Term& term : terms) {
    summary.terms.push_back({.term = std::string(TermName(term)),
                             .before = CostOf(term, view, view.start),
                             .after = CostOf(term, view, solution.net)});
  }
  const SparseMatrix matrix = ObservationMatrix(view);
  summary.uncovered_vertices = UncoveredVertices(matrix);
  summary.rank = NumericalRank(matrix);
  summary.rms_before_mm = ObservationRms(view, view.start);
  summary.rms_after_mm = ObservationRms(view, solution.net);
  summary.max_move_mm = MaxMove(view.start, solution.net);
}

}  // namespace

LevelSolution FitLevel(LevelView view, std::span<const Term> terms) {
  CheckView(view, terms);
  SortObservations(view.observations);
  LevelSolution solution{.net = view.start, .summary = {}};
  Solve(view, terms, solution);
  Measure(view, terms, solution);
  return solution;
}

double ObservationRms(const LevelView& view, const ControlNet& net) {
  double sum = 0, weights = 0;
  for (const Observation& o : view.observations) {
    sum += o.weight * (o.stencil.Apply(net) - o.position).squaredNorm();
    weights += o.weight;
  }
  return weights > 0 ? std::sqrt(sum / weights) : kNaN;
}

}  // namespace semblance
