// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/coupled_solver.h"

#include <ceres/cost_function.h>
#include <ceres/problem.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "fitting/least_squares/triangle_sum.h"
#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

constexpr int kMostSteps = 50;
constexpr double kLeastMove = 1e-13;  // of the norm of all vertices

// The residuals of a problem over a net, block by block.
class ResidualBlocks {
 public:
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  struct Block {
    Eigen::VectorXd residual;
    std::vector<int> vertices;
    std::vector<Matrix> slopes;  // one per vertex
  };

  ResidualBlocks(const ceres::Problem& problem, const ControlNet& net)
      : problem_(problem), first_(net.vertices.front().data()) {
    problem.GetResidualBlocks(&blocks_);
  }

  void ForEach(const auto& use) const {
    for (const ceres::ResidualBlockId id : blocks_) {
      use(At(id));
    }
  }

 private:
  Block At(ceres::ResidualBlockId id) const {
    Block block;
    std::vector<double*> parameters;
    problem_.GetParameterBlocksForResidualBlock(id, &parameters);
    block.residual.resize(problem_.GetCostFunctionForResidualBlock(id)->num_residuals());
    block.slopes.assign(parameters.size(), Matrix(block.residual.size(), 3));
    std::vector<double*> slopes;
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      block.vertices.push_back(static_cast<int>((parameters[k] - first_) / 3));
      slopes.push_back(block.slopes[k].data());
    }
    problem_.EvaluateResidualBlock(id, /*apply_loss_function=*/false, nullptr,
                                   block.residual.data(), slopes.data());
    return block;
  }

  const ceres::Problem& problem_;
  const double* first_;
  std::vector<ceres::ResidualBlockId> blocks_;
};

SparseMatrix NormalMatrix(const ResidualBlocks& blocks, std::size_t vertices) {
  TriangleSum sum(static_cast<Eigen::Index>(3 * vertices));
  blocks.ForEach([&](const ResidualBlocks::Block& block) {
    for (std::size_t a = 0; a < block.vertices.size(); ++a) {
      for (std::size_t b = 0; b < block.vertices.size(); ++b) {
        if (block.vertices[a] < block.vertices[b]) {
          continue;
        }
        const Mat3 product = block.slopes[a].transpose() * block.slopes[b];
        for (int k = 0; k < 9; ++k) {
          const int row = 3 * block.vertices[a] + k % 3, column = 3 * block.vertices[b] + k / 3;
          if (row >= column) {
            sum.Add(row, column, product(k % 3, k / 3));
          }
        }
      }
    }
  });
  return sum.Take();
}

// Minus the gradient.
Eigen::VectorXd Downhill(const ResidualBlocks& blocks, std::size_t vertices) {
  Eigen::VectorXd down = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * vertices));
  blocks.ForEach([&](const ResidualBlocks::Block& block) {
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      down.segment<3>(3 * block.vertices[k]) -= block.slopes[k].transpose() * block.residual;
    }
  });
  return down;
}

// Weakly held vertices take several steps to come to rest; rounding may keep them from it.
bool AtRest(double move, double last_move) {
  return move <= kLeastMove || (move <= 1e-9 && move >= last_move);
}

// In exact arithmetic no step is longer than the first. One that is, by more than rounding, tells
// of a matrix so close to singular that its factor leads away from the solution.
bool Diverges(double length, double first_length, double move) {
  constexpr double kRounding = 1e-6;
  return length > first_length && move > kRounding;
}

}  // namespace

SolverOutcome SolveCoupled(const LevelView& view, std::span<const Term> terms, ControlNet& net) {
  ceres::Problem problem;
  AddResiduals(terms, view, net, problem);
  SolverOutcome outcome{.free_vertices = problem.NumParameterBlocks()};
  if (outcome.free_vertices == 0) {
    return outcome;
  }
  const std::size_t vertices = net.vertices.size();
  const ResidualBlocks blocks(problem, net);
  const SparseFactor factor(NormalMatrix(blocks, vertices), ProximalShift(terms, vertices));
  const ControlNet before = net;
  Eigen::Map<Eigen::VectorXd> x(net.vertices.front().data(),
                                static_cast<Eigen::Index>(3 * vertices));
  outcome.usable = factor.usable();
  outcome.termination = outcome.usable ? "no_convergence" : "failure";
  double move = 1e300, first_length = 1e300;
  while (outcome.usable && outcome.iterations < kMostSteps) {
    const Eigen::VectorXd step = factor.Solve(Downhill(blocks, vertices));
    x += step;
    ++outcome.iterations;
    const double length = step.norm();
    const double last_move = std::exchange(move, length / std::max(x.norm(), 1e-13));
    first_length = outcome.iterations == 1 ? length : first_length;
    outcome.usable = step.allFinite() && !Diverges(length, first_length, move);
    if (outcome.usable && AtRest(move, last_move)) {
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

}  // namespace semblance
