// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/level/reweighting.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fitting/level/blocked_solver.h"
#include "fitting/terms/robust_loss.h"
#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

constexpr int kMostSteps = 300;

// Plain least squares with the weights that the losses give at `net`: one term of the points, in
// place of all, and the others.
struct Reweighted {
  LevelView view;
  std::vector<Term> terms;

  Reweighted(const LevelView& given, std::span<const Term> all) : view(given) {
    for (const Term& term : all) {
      if (!std::holds_alternative<PointTerm>(term) && !std::holds_alternative<LandmarkTerm>(term)) {
        terms.push_back(term);
      }
    }
    terms.emplace_back(PointTerm{});
  }

  void Weigh(const LevelView& given, std::span<const Term> all, const ControlNet& net) {
    const std::vector<double> weights = CostWeights(given, all, net);
    view.observations.clear();
    for (std::size_t k = 0; k < weights.size(); ++k) {
      if (weights[k] > 0) {
        view.observations.push_back(given.observations[k]);
        view.observations.back().weight = weights[k];
      }
    }
    std::get<PointTerm>(terms.back()).weight = std::accumulate(weights.begin(), weights.end(), 0.0);
  }
};

// Of the vertices' move, of that of all coordinates.
double Move(const ControlNet& from, const ControlNet& to) {
  double move = 0, size = 0;
  for (std::size_t k = 0; k < to.vertices.size(); ++k) {
    move += (to.vertices[k] - from.vertices[k]).squaredNorm();
    size += to.vertices[k].squaredNorm();
  }
  return std::sqrt(move / std::max(size, 1e-26));
}

}  // namespace

std::vector<double> CostWeights(const LevelView& view, std::span<const Term> terms,
                                const ControlNet& net) {
  const double sum = view.WeightSum(), landmarks = view.LandmarkWeightSum();
  std::vector<double> weights;
  for (const Observation& o : view.observations) {
    const double squared = (view.PointAt(o.uv, net) - o.position).squaredNorm();
    double factor = 0;  // over the points' weights
    for (const Term& term : terms) {
      if (const auto* const points = std::get_if<PointTerm>(&term)) {
        factor += points->weight * RhoSlope(*points, squared);
      } else if (const auto* const tangent = std::get_if<TangentPointTerm>(&term)) {
        factor += tangent->weight;
      } else if (const auto* const landmark = std::get_if<LandmarkTerm>(&term)) {
        factor += o.landmark ? landmark->weight * sum / landmarks : 0;
      }
    }
    weights.push_back(factor * o.weight / sum);
  }
  return weights;
}

SolverOutcome SolveReweighted(const LevelView& view, std::span<const Term> terms,
                              const SeparableSolver& solve, ControlNet& net, double least_move) {
  const ControlNet before = net;
  Reweighted problem(view, terms);
  SolverOutcome outcome{.termination = "no_convergence"};
  while (outcome.usable && outcome.iterations < kMostSteps) {
    problem.Weigh(view, terms, net);
    const ControlNet last = net;
    const SolverOutcome step = solve(problem.view, problem.terms, net);
    ++outcome.iterations;
    outcome.usable = step.usable;
    outcome.free_vertices = std::max(outcome.free_vertices, step.free_vertices);
    if (step.free_vertices == 0 || Move(last, net) <= least_move) {
      outcome.termination = "convergence";
      break;
    }
  }
  if (!outcome.usable) {
    outcome.termination = "failure";
    net = before;
  }
  return outcome;
}

SolverOutcome Minimise(const LevelView& view, std::span<const Term> terms, LevelSolver solver,
                       ControlNet& net, double least_move) {
  if (!SeparableButForLoss(terms)) {
    return SolveByCeres(view, terms, net);
  }
  const auto solve = solver == LevelSolver::kFastest ? SolveDirectly : SolveBlocked;
  return AllSeparable(terms) ? solve(view, terms, net)
                             : SolveReweighted(view, terms, solve, net, least_move);
}

}  // namespace semblance
