// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/level/level_solver.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <vector>

#include "fitting/least_squares/blas_threads.h"
#include "fitting/least_squares/normal_equations.h"
#include "fitting/least_squares/sparse_factor.h"
#include "fitting/level/level_cost.h"

namespace semblance {
namespace {

constexpr int kMaxIterations = 50;
constexpr double kStepTolerance = 1e-13;  // of the norm of all vertices

// What the eigenvalues of the normal equations are measured by: residuals are means over points or
// vertices, so a vertex that is well held has about weight / vertices on the diagonal.
double TypicalStiffness(std::span<const Term> terms, std::size_t vertices) {
  double sum = 0;
  for (const Term& term : terms) {
    const auto* const prior = std::get_if<PriorTerm>(&term);
    sum += prior != nullptr && prior->held_only ? 0 : WeightOf(term);
  }
  return sum / static_cast<double>(vertices);
}

double Radius(double stiffness) { return std::min(1e8 / stiffness, 1e16); }

// Moves the vertices; returns the length of the step over that of all coordinates.
double Step(const Eigen::MatrixX3d& step, ControlNet& net) {
  double length = 0, size = 0;
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    if (!step.row(k).isZero(0)) {
      net.vertices[k] += step.row(k).transpose();
    }
    length += step.row(k).squaredNorm();
    size += net.vertices[k].squaredNorm();
  }
  return std::sqrt(length / std::max(size, 1e-26));
}

// All terms' matrix; that of the points is kept on the way.
SparseMatrix NormalOf(const LevelView& view, std::span<const Term> terms, SparseMatrix& points) {
  std::vector<Term> observing, others;
  for (const Term& term : terms) {
    (std::holds_alternative<PointTerm>(term) && WeightOf(term) > 0 ? observing : others)
        .push_back(term);
  }
  NormalMatrix matrix(view.grid);
  AddAllRows(view, observing, matrix);
  if (!observing.empty()) {
    points = matrix.Lower();
  }
  AddAllRows(view, others, matrix);
  return matrix.Lower();
}

Eigen::MatrixX3d ResidualOf(const LevelView& view, std::span<const Term> terms,
                            const ControlNet& net) {
  NormalResidual residual(net);
  AddAllRows(view, terms, residual);
  return residual.Sum();
}

void Descend(const LevelView& view, std::span<const Term> terms, const SparseMatrix& normal,
             ControlNet& net, SolverOutcome& outcome) {
  const SparseFactor factor(normal, 1 / Radius(TypicalStiffness(terms, net.vertices.size())));
  outcome.usable = factor.usable();
  outcome.termination = "no_convergence";
  while (outcome.usable && outcome.iterations < kMaxIterations) {
    const Eigen::MatrixX3d step = factor.Solve(ResidualOf(view, terms, net));
    outcome.usable = step.allFinite();
    ++outcome.iterations;
    if (outcome.usable && Step(step, net) <= kStepTolerance) {
      outcome.termination = "convergence";
      break;
    }
  }
}

}  // namespace

// Ceres damps by D / radius with D clamped to [min, max]; both at 1 give the identity, and a fixed
// radius the proximal-point iteration x <- argmin cost(y) + |y - x|^2 / radius, which goes to the
// least-squares solution nearest to the start. Damping by the diagonal, Ceres' default, would
// instead move the least-held vertices most. Determined directions converge in two or three steps.
ceres::Solver::Options CeresOptions(std::span<const Term> terms, std::size_t vertices) {
  UseOneBlasThread();
  const double stiffness = TypicalStiffness(terms, vertices);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.jacobi_scaling = false;
  options.min_lm_diagonal = options.max_lm_diagonal = 1;
  options.initial_trust_region_radius = Radius(stiffness);
  options.max_trust_region_radius = options.initial_trust_region_radius;
  options.max_num_iterations = kMaxIterations;
  options.function_tolerance = 1e-15;
  options.gradient_tolerance = 0;  // blind to weakly determined directions
  options.parameter_tolerance = kStepTolerance;
  return options;
}

std::string TerminationName(ceres::TerminationType type) {
  std::string text = ceres::TerminationTypeToString(type);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

void AddAllRows(const LevelView& view, std::span<const Term> terms, RowSink& sink) {
  for (const Term& term : terms) {
    if (WeightOf(term) > 0) {
      std::visit(
          [&]<class T>(const T& t) {
            if constexpr (RowTerm<T>) {
              AddRows(t, view, sink);
            }
          },
          term);
    }
  }
}

bool AllSeparable(std::span<const Term> terms) {
  return std::all_of(terms.begin(), terms.end(), [](const Term& term) {
    return WeightOf(term) <= 0 || std::visit([](const auto& t) { return IsSeparable(t); }, term);
  });
}

SolverOutcome SolveByCeres(const LevelView& view, std::span<const Term> terms, ControlNet& net) {
  ceres::Problem problem;
  for (const Term& term : terms) {
    if (WeightOf(term) > 0) {
      std::visit([&](const auto& t) { AddResiduals(t, view, net, problem); }, term);
    }
  }
  SolverOutcome outcome{.free_vertices = problem.NumParameterBlocks()};
  if (outcome.free_vertices == 0) {
    return outcome;
  }
  const ControlNet before = net;
  ceres::Solver::Summary summary;
  ceres::Solve(CeresOptions(terms, net.vertices.size()), &problem, &summary);
  outcome.iterations = static_cast<int>(summary.iterations.size()) - 1;
  outcome.termination = TerminationName(summary.termination_type);
  outcome.usable = summary.IsSolutionUsable();
  if (!outcome.usable) {
    net = before;
  }
  return outcome;
}

SolverOutcome SolveDirectly(const LevelView& view, std::span<const Term> terms, ControlNet& net) {
  SolverOutcome outcome;
  const SparseMatrix normal = NormalOf(view, terms, outcome.points);
  outcome.free_vertices = static_cast<int>((normal.diagonal().array() > 0).count());
  if (outcome.free_vertices == 0) {
    return outcome;
  }
  const ControlNet before = net;
  Descend(view, terms, normal, net, outcome);
  if (!outcome.usable) {
    outcome.termination = "failure";
    net = before;
  }
  return outcome;
}

}  // namespace semblance
