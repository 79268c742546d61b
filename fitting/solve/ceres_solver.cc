// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/ceres_solver.h"

#include <ceres/cost_function.h>
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "fitting/least_squares/qr_compression.h"
#include "fitting/least_squares/sparse_factor.h"
#include "fitting/terms/tangent_points.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/lower_case.h"

namespace semblance::fitting {
namespace {

constexpr int kMaxIterations = 50;        // determined directions need two or three
constexpr double kStepTolerance = 1e-13;  // relative to the norm of all vertices; round-off

// The typical eigenvalue of the normal equations. Residuals are means over points or vertices, so a
// well-determined vertex has about weight / vertices on the diagonal.
double TypicalStiffness(std::span<const Term> terms, std::size_t vertices) {
  double sum = 0;
  for (const Term& term : terms) {
    const auto* const prior = std::get_if<PriorTerm>(&term);
    sum += prior != nullptr && prior->held_only ? 0 : TermWeight(term);
  }
  return sum / static_cast<double>(vertices);
}

// The radius of the trust region: the damping 1 / radius is 1e-8 of the typical stiffness, small
// against determined directions and large against round-off.
double Radius(std::span<const Term> terms, std::size_t vertices) {
  return std::min(1e8 / TypicalStiffness(terms, vertices), 1e16);
}

// Ceres damps by D / radius with D clamped to [min, max]. With both at 1, D is the identity, and a
// fixed radius gives the proximal-point iteration x <- argmin cost(y) + |y - x|^2 / radius, which
// converges to the least-squares solution nearest to the start. Ceres' default, damping by the
// diagonal, would instead move weakly determined vertices most. Determined directions converge in
// two or three steps.
ceres::Solver::Options CeresOptions(std::span<const Term> terms, std::size_t vertices) {
  UseOneLibraryThread();
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.jacobi_scaling = false;
  options.min_lm_diagonal = options.max_lm_diagonal = 1;
  options.initial_trust_region_radius = Radius(terms, vertices);
  options.max_trust_region_radius = options.initial_trust_region_radius;
  options.max_num_iterations = kMaxIterations;
  options.function_tolerance = 1e-15;
  options.gradient_tolerance = 0;  // the gradient is tiny along weakly determined directions
  options.parameter_tolerance = kStepTolerance;
  return options;
}

// Stops if a step is rejected whose change of the cost is round-off. Nothing is left to gain, and
// Ceres would try shorter steps, each with its own factor.
class StopAtRounding final : public ceres::IterationCallback {
 public:
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& step) override {
    constexpr double kRounding = 1e-13;  // of the cost, a sum of many squares
    const bool rounding = step.iteration > 0 && step.step_is_valid && !step.step_is_successful &&
                          std::abs(step.cost_change) <= kRounding * step.cost;
    return rounding ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
};

std::string TerminationName(ceres::TerminationType type) {
  if (type == ceres::USER_SUCCESS) {
    return "convergence";  // StopAtRounding
  }
  return LowerCase(ceres::TerminationTypeToString(type));
}

constexpr int kSide = 3, kTile = kSide * kSide;  // vertices of a tile: dense blocks of useful size

// Factor of all residuals. Ceres stops if subtracting the gradient from the vertices changes no
// digit; the factor makes the gradient larger by its square, so that Ceres does not stop too early.
constexpr double kScale = 1e4;

struct Slot {
  int tile = -1;   // index among all tiles, or among the tiles of a block of rows
  int place = -1;  // place in the tile
};

// The tiles of 3 x 3 vertices of one level that contain the dofs. Places without a dof stay empty.
class Tiles {
 public:
  explicit Tiles(const LevelView& view) {
    std::map<std::array<int, 3>, int> known;
    for (int dof = 0; dof < static_cast<int>(view.start.vertices.size()); ++dof) {
      const VertexId v = VertexOf(view, dof);
      const int next = static_cast<int>(known.size());
      const int tile = known.try_emplace({v.level, v.j / kSide, v.i / kSide}, next).first->second;
      slots_.push_back({tile, v.i % kSide + kSide * (v.j % kSide)});
    }
    count_ = static_cast<int>(known.size());
  }

  int count() const { return count_; }
  const Slot& At(int dof) const { return slots_[dof]; }
  const std::vector<Slot>& slots() const { return slots_; }

 private:
  static VertexId VertexOf(const LevelView& view, int dof) {
    const int columns = view.grid.Columns();
    return view.space != nullptr ? view.space->Vertex(dof)
                                 : VertexId{0, dof % columns, dof / columns};
  }

  std::vector<Slot> slots_;  // one per dof
  int count_ = 0;
};

// Rows A X - B over some dofs, with their tiles and the slot of each column.
struct TileRows {
  std::shared_ptr<const Eigen::MatrixXd> a;
  Rows3 b;
  std::vector<int> tiles;
  std::vector<Slot> columns;
};

// The residual of TileRows for one coordinate.
class BlockedLinearCost final : public ceres::CostFunction {
 public:
  BlockedLinearCost(std::shared_ptr<const TileRows> rows, int coordinate)
      : rows_(std::move(rows)), coordinate_(coordinate) {
    mutable_parameter_block_sizes()->assign(rows_->tiles.size(), kTile);
    set_num_residuals(static_cast<int>(rows_->a->rows()));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, kTile, Eigen::RowMajor>;
    const Eigen::MatrixXd& a = *rows_->a;
    Eigen::Map<Eigen::VectorXd> r(residuals, a.rows());
    r = -rows_->b.col(coordinate_);
    for (std::size_t t = 0; jacobians != nullptr && t < rows_->tiles.size(); ++t) {
      if (jacobians[t] != nullptr) {
        Eigen::Map<Jacobian>(jacobians[t], a.rows(), kTile).setZero();
      }
    }
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      const Slot& slot = rows_->columns[k];
      r += a.col(k) * parameters[slot.tile][slot.place];
      if (jacobians != nullptr && jacobians[slot.tile] != nullptr) {
        Eigen::Map<Jacobian>(jacobians[slot.tile], a.rows(), kTile).col(slot.place) += a.col(k);
      }
    }
    return true;
  }

 private:
  std::shared_ptr<const TileRows> rows_;
  int coordinate_;
};

// Collects the rows of all terms, compressed to at most sixteen per patch.
class BlockedRowSink final : public RowSink {
 public:
  explicit BlockedRowSink(const Tiles& tiles) : tiles_(tiles), touched_(tiles.slots().size()) {}

  void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
           std::span<const int> vertices) override {
    CompressShared(a, b);
    TileRows rows{.a = std::make_shared<const Eigen::MatrixXd>(kScale * *a),
                  .b = kScale * b,
                  .tiles = {},
                  .columns = {}};
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      const Slot& slot = tiles_.At(vertices[k]);
      const auto at = std::find(rows.tiles.begin(), rows.tiles.end(), slot.tile);
      rows.columns.push_back({static_cast<int>(at - rows.tiles.begin()), slot.place});
      if (at == rows.tiles.end()) {
        rows.tiles.push_back(slot.tile);
      }
      if (!rows.a->col(static_cast<Eigen::Index>(k)).isZero(0)) {
        touched_[vertices[k]] = 1;
      }
    }
    rows_.push_back(std::make_shared<const TileRows>(std::move(rows)));
  }

  int Touched() const { return static_cast<int>(std::count(touched_.begin(), touched_.end(), 1)); }
  const std::vector<std::shared_ptr<const TileRows>>& rows() const { return rows_; }

 private:
  const Tiles& tiles_;
  std::vector<char> touched_;  // per dof, whether some row has a non-zero column for it
  std::vector<std::shared_ptr<const TileRows>> rows_;
};

// Solves for one coordinate of the net.
ceres::Solver::Summary SolveCoordinate(const BlockedRowSink& sink, const Tiles& tiles,
                                       int coordinate, const ceres::Solver::Options& options,
                                       ControlNet& net) {
  std::vector<std::array<double, kTile>> values(tiles.count());
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    const Slot& slot = tiles.slots()[k];
    values[slot.tile][slot.place] = net.vertices[k][coordinate];
  }
  ceres::Problem problem;
  for (const auto& rows : sink.rows()) {
    std::vector<double*> blocks;
    for (const int tile : rows->tiles) {
      blocks.push_back(values[tile].data());
    }
    problem.AddResidualBlock(new BlockedLinearCost(rows, coordinate), nullptr, blocks);
  }
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (std::size_t k = 0; summary.IsSolutionUsable() && k < net.vertices.size(); ++k) {
    const Slot& slot = tiles.slots()[k];
    net.vertices[k][coordinate] = values[slot.tile][slot.place];
  }
  return summary;
}

}  // namespace

double ProximalShift(std::span<const Term> terms, std::size_t vertices) {
  return 1 / Radius(terms, vertices);
}

SolverOutcome SolveByCeres(const LevelView& view, std::span<const Term> terms, ControlNet& net) {
  ceres::Problem problem;
  AddResiduals(terms, view, net, problem);
  SolverOutcome outcome{.free_vertices = problem.NumParameterBlocks()};
  if (outcome.free_vertices == 0) {
    return outcome;
  }
  const ControlNet before = net;
  StopAtRounding stop;
  ceres::Solver::Options options = CeresOptions(terms, net.vertices.size());
  options.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  outcome.iterations = static_cast<int>(summary.iterations.size()) - 1;
  outcome.termination = TerminationName(summary.termination_type);
  outcome.usable = summary.IsSolutionUsable();
  if (!outcome.usable) {
    net = before;
  }
  return outcome;
}

SolverOutcome SolveBlocked(const LevelView& view, std::span<const Term> terms, ControlNet& net) {
  const Tiles tiles(view);
  BlockedRowSink sink(tiles);
  AddRows(terms, view, sink);
  SolverOutcome outcome{.free_vertices = sink.Touched()};
  if (outcome.free_vertices == 0) {
    return outcome;
  }
  const ControlNet before = net;
  ceres::Solver::Options options = CeresOptions(terms, net.vertices.size());
  options.initial_trust_region_radius /= kScale * kScale;
  options.max_trust_region_radius /= kScale * kScale;
  for (int coordinate = 0; coordinate < 3; ++coordinate) {
    const ceres::Solver::Summary summary = SolveCoordinate(sink, tiles, coordinate, options, net);
    const int steps = static_cast<int>(summary.iterations.size()) - 1;
    if (coordinate == 0 || steps >= outcome.iterations) {
      outcome.iterations = steps;
      outcome.termination = TerminationName(summary.termination_type);
    }
    outcome.usable = outcome.usable && summary.IsSolutionUsable();
  }
  if (!outcome.usable) {
    outcome.termination = "failure";
    net = before;
  }
  return outcome;
}

namespace {

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

// The least-squares problem of the terms over a net. Tangent points are summed point by point
// (tangent_points.h); all other terms are evaluated as residual blocks of a ceres::Problem.
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

  // The number of vertices with an effect on some term.
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
  // product(a, b): the 3 x 3 block of the a-th and b-th of the vertices.
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

// Returns whether the steps have converged. Weakly determined vertices need several steps, and
// round-off may keep the steps from becoming shorter than the tolerance.
bool AtRest(double move, double last_move) {
  return move <= kStepTolerance || (move <= 1e-9 && move >= last_move);
}

// In exact arithmetic no step is longer than the first. A step that is longer by more than
// round-off shows a matrix so close to singular that its factor leads away from the solution.
bool Diverges(double length, double first_length, double move) {
  constexpr double kRounding = 1e-6;  // shorter steps may grow by round-off
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
  while (outcome.usable && outcome.iterations < kMaxIterations) {
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

}  // namespace semblance::fitting
