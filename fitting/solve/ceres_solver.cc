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
#include <utility>
#include <vector>

#include "fitting/least_squares/qr_compression.h"
#include "fitting/least_squares/sparse_factor.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/lower_case.h"

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

// Of the trust region.
double Radius(std::span<const Term> terms, std::size_t vertices) {
  return std::min(1e8 / TypicalStiffness(terms, vertices), 1e16);
}

// Ceres damps by D / radius with D clamped to [min, max]; both at 1 give the identity, and a fixed
// radius the proximal-point iteration x <- argmin cost(y) + |y - x|^2 / radius, which goes to the
// least-squares solution nearest to the start. Damping by the diagonal, Ceres' default, would
// instead move the least-held vertices most. Determined directions converge in two or three steps.
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
  options.gradient_tolerance = 0;  // blind to weakly determined directions
  options.parameter_tolerance = kStepTolerance;
  return options;
}

// A step is rejected although it changes the cost by no more than rounding does: there is nothing
// left to gain, and shorter steps would be rejected likewise, each with a factor of its own.
class StopAtRounding final : public ceres::IterationCallback {
 public:
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& step) override {
    constexpr double kRounding = 1e-13;
    const bool rounding = step.iteration > 0 && step.step_is_valid && !step.step_is_successful &&
                          std::abs(step.cost_change) <= kRounding * step.cost;
    return rounding ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
};

std::string TerminationName(ceres::TerminationType type) {
  if (type == ceres::USER_SUCCESS) {
    return "convergence";  // by StopAtRounding
  }
  return LowerCase(ceres::TerminationTypeToString(type));
}

constexpr int kSide = 3, kTile = kSide * kSide;

// Of all residuals. Ceres stops where the vertices less their gradient are the vertices again, to
// the last digit; in these units the gradient is larger by the square.
constexpr double kScale = 1e4;

struct Slot {
  int tile = -1;   // of all; in a block of rows: which of its tiles
  int place = -1;  // in the tile
};

// The tiles of 3 x 3 vertices of one level that hold the dofs. Places of vertices that are none
// stay empty.
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

  std::vector<Slot> slots_;  // of each dof
  int count_ = 0;
};

// A X - B over some dofs; their tiles and where each column is in them.
struct TileRows {
  std::shared_ptr<const Eigen::MatrixXd> a;
  Rows3 b;
  std::vector<int> tiles;
  std::vector<Slot> columns;
};

// One coordinate of TileRows.
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

// Keeps the rows of all terms, those of a patch reduced to at most sixteen.
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
  std::vector<char> touched_;  // dofs
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

}  // namespace semblance
