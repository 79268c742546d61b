// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/level/level_solver.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <vector>

#include "fitting/least_squares/blas_threads.h"
#include "fitting/least_squares/sparse_factor.h"
#include "fitting/level/level_cost.h"
#include "fitting/terms/term_cost.h"

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

// The points' matrix is kept on the way.
NormalSystem LevelEquations::System(std::span<const Term> terms) {
  std::vector<Term> observing, others;
  for (const Term& term : terms) {
    (std::holds_alternative<PointTerm>(term) && WeightOf(term) > 0 ? observing : others)
        .push_back(term);
  }
  NormalMatrix matrix(view_.grid);
  AddRows(observing, view_, matrix);
  if (!observing.empty()) {
    points_ = matrix.Lower();
  }
  AddRows(others, view_, matrix);
  return {matrix.Lower(), Right(terms)};
}

Eigen::MatrixX3d LevelEquations::Right(std::span<const Term> terms) {
  NormalResidual residual(net_);
  AddRows(terms, view_, residual);
  return residual.Sum();
}

// The length of the step over that of all coordinates.
double LevelEquations::Move(const Eigen::MatrixX3d& step, const Eigen::MatrixX3d& /*right*/) {
  double length = 0, size = 0;
  for (std::size_t k = 0; k < net_.vertices.size(); ++k) {
    if (!step.row(k).isZero(0)) {
      net_.vertices[k] += step.row(k).transpose();
    }
    length += step.row(k).squaredNorm();
    size += net_.vertices[k].squaredNorm();
  }
  return std::sqrt(length / std::max(size, 1e-26));
}

SolverOutcome Descend(TermEquations& equations, std::span<const Term> terms,
                      const DescentOptions& options) {
  NormalSystem system = equations.System(terms);
  SolverOutcome outcome{.free_vertices =
                            static_cast<int>((system.lower.diagonal().array() > 0).count())};
  if (outcome.free_vertices == 0) {
    return outcome;
  }
  outcome.termination = "no_convergence";
  std::optional<SparseFactor> factor;
  while (outcome.iterations < kMaxIterations) {
    if (outcome.iterations > 0 && options.reweighted) {
      system = equations.System(terms);
    } else if (outcome.iterations > 0) {
      system.right = equations.Right(terms);
    }
    if (!factor || options.reweighted) {
      const double mean = std::max(system.lower.diagonal().mean(), 1e-300);
      factor.emplace(system.lower, options.shift + options.relative_shift * mean);
    }
    ++outcome.iterations;
    const Eigen::MatrixX3d step =
        factor->usable() ? Eigen::MatrixX3d(factor->Solve(system.right)) : Eigen::MatrixX3d();
    outcome.usable = factor->usable() && step.allFinite();
    const double moved = outcome.usable ? equations.Move(step, system.right) : 0;
    if (!(moved > options.least_move) || options.one_step) {
      outcome.termination = !outcome.usable                 ? "failure"
                            : !(moved > options.least_move) ? "convergence"
                                                            : "first step";
      break;
    }
  }
  return outcome;
}

SolverOutcome SolveDirectly(const LevelView& view, std::span<const Term> terms, ControlNet& net) {
  const ControlNet before = net;
  LevelEquations equations(view, net);
  const double stiffness = TypicalStiffness(terms, net.vertices.size());
  SolverOutcome outcome =
      Descend(equations, terms, {.shift = 1 / Radius(stiffness), .least_move = kStepTolerance});
  outcome.points = equations.points();
  if (!outcome.usable) {
    net = before;
  }
  return outcome;
}

LevelSummary SummaryOf(std::span<const Term> terms, const Standing& before, const Standing& after,
                       const SolverOutcome& outcome) {
  LevelSummary summary{.terms = {},
                       .rms_before_mm = before.rms_mm,
                       .rms_after_mm = after.rms_mm,
                       .iterations = outcome.iterations,
                       .free_vertices = outcome.free_vertices,
                       .termination = outcome.termination,
                       .usable = outcome.usable};
  for (std::size_t k = 0; k < terms.size(); ++k) {
    summary.terms.push_back({std::string(TermName(terms[k])), before.costs[k], after.costs[k]});
  }
  return summary;
}

void NoteCoverage(const PointCover& cover, LevelSummary& summary) {
  summary.coverage = CoverageOf(cover.patch_counts);
  summary.uncovered_vertices =
      static_cast<int>((cover.points.diagonal().array() <= 0).count()) - cover.covered;
  summary.rank = NumericalRank(cover.points, cover.count);
}

}  // namespace semblance
