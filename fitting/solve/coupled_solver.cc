// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/coupled_solver.h"

#include <ceres/cost_function.h>
#include <ceres/problem.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/terms/tangent_points.h"
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

  std::vector<int> Vertices() const {
    std::vector<double*> parameters;
    problem_.GetParameterBlocks(&parameters);
    std::vector<int> vertices;
    for (const double* const parameter : parameters) {
      vertices.push_back(VertexOf(parameter));
    }
    return vertices;
  }

 private:
  int VertexOf(const double* parameter) const { return static_cast<int>((parameter - first_) / 3); }

  Block At(ceres::ResidualBlockId id) const {
    Block block;
    std::vector<double*> parameters;
    problem_.GetParameterBlocksForResidualBlock(id, &parameters);
    block.residual.resize(problem_.GetCostFunctionForResidualBlock(id)->num_residuals());
    block.slopes.assign(parameters.size(), Matrix(block.residual.size(), 3));
    std::vector<double*> slopes;
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      block.vertices.push_back(VertexOf(parameters[k]));
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

// The least squares of the terms over a net: points that slide as they are, all other terms as
// Ceres has them.
class CoupledSquares {
 public:
  CoupledSquares(std::span<const Term> terms, const LevelView& view, ControlNet& net) : net_(net) {
    for (const Term& term : terms) {
      const auto* const sliding = std::get_if<TangentPointTerm>(&term);
      if (sliding != nullptr && sliding->weight > 0 && !view.observations.empty()) {
        sliding_.emplace_back(*sliding, view);
      } else {
        AddResiduals(std::span(&term, 1), view, net, problem_);
      }
    }
    blocks_.emplace(problem_, net);
  }

  // Vertices that some term touches.
  int FreeVertices() const {
    std::vector<char> touched(net_.vertices.size(), 0);
    const auto touch = [&](std::span<const int> vertices) {
      for (const int vertex : vertices) {
        touched[vertex] = 1;
      }
    };
    touch(blocks_->Vertices());
    for (const TangentSums& sums : sliding_) {
      sums.ForEachDof(touch);
    }
    return static_cast<int>(std::ranges::count(touched, 1));
  }

  SparseMatrix NormalMatrix() const {
    BlockTriangleSum sum(net_.vertices.size());
    blocks_->ForEach([&](const ResidualBlocks::Block& block) {
      Add(
          block.vertices,
          [&](std::size_t a, std::size_t b) -> Mat3 {
            return block.slopes[a].transpose() * block.slopes[b];
          },
          sum);
    });
    for (const TangentSums& sums : sliding_) {
      sums.ForEachElement([&](std::span<const int> dofs, const Eigen::MatrixXd& normal) {
        Add(
            dofs,
            [&](std::size_t a, std::size_t b) -> Mat3 {
              return normal.block<3, 3>(static_cast<Eigen::Index>(3 * a),
                                        static_cast<Eigen::Index>(3 * b));
            },
            sum);
      });
    }
    return sum.Take();
  }

  // Minus the gradient.
  Eigen::VectorXd Downhill() const {
    Eigen::VectorXd down =
        Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * net_.vertices.size()));
    blocks_->ForEach([&](const ResidualBlocks::Block& block) {
      for (std::size_t k = 0; k < block.vertices.size(); ++k) {
        down.segment<3>(3 * block.vertices[k]) -= block.slopes[k].transpose() * block.residual;
      }
    });
    for (const TangentSums& sums : sliding_) {
      sums.AddDownhill(net_, down);
    }
    return down;
  }

 private:
  // product(a, b): 3 x 3 of the a-th and the b-th of the vertices.
  static void Add(std::span<const int> vertices, const auto& product, BlockTriangleSum& sum) {
    for (std::size_t a = 0; a < vertices.size(); ++a) {
      for (std::size_t b = 0; b < vertices.size(); ++b) {
        if (vertices[a] >= vertices[b]) {
          sum.Add(vertices[a], vertices[b], product(a, b));
        }
      }
    }
  }

  const ControlNet& net_;
  ceres::Problem problem_;
  std::optional<ResidualBlocks> blocks_;
  std::vector<TangentSums> sliding_;
};

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
  const CoupledSquares squares(terms, view, net);
  SolverOutcome outcome{.free_vertices = squares.FreeVertices()};
  if (outcome.free_vertices == 0) {
    return outcome;
  }
  const std::size_t vertices = net.vertices.size();
  const SparseFactor factor(squares.NormalMatrix(), ProximalShift(terms, vertices),
                            RowKind::kCoordinate);
  const ControlNet before = net;
  Eigen::Map<Eigen::VectorXd> x(net.vertices.front().data(),
                                static_cast<Eigen::Index>(3 * vertices));
  outcome.usable = factor.usable();
  outcome.termination = outcome.usable ? "no_convergence" : "failure";
  double move = 1e300, first_length = 1e300;
  while (outcome.usable && outcome.iterations < kMostSteps) {
    const Eigen::VectorXd step = factor.Solve(squares.Downhill());
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
