// SPDX-License-Identifier: GPL-3.0-or-later
// The ways to minimise terms, whatever holds the surface: a level (level_fit.h) or all levels at
// once (adaptive_solve.h).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fitting/least_squares/normal_equations.h"
#include "fitting/level/level_fit.h"

namespace semblance {

struct SolverOutcome {
  int iterations = 0;
  int free_vertices = 0;  // that some term touches
  std::string termination = "nothing to solve";
  bool usable = true;        // else the net is as it was
  SparseMatrix points = {};  // lower normal matrix of the points, times some factor; by
                             // SolveDirectly if they are among the terms, else 0 x 0
};

// The normal equations of separable terms over the unknowns that make a surface.
class TermEquations {
 public:
  virtual ~TermEquations() = default;
  // Where the surface stands.
  virtual NormalSystem System(std::span<const Term> terms) = 0;
  // The right side of that alone.
  virtual Eigen::MatrixX3d Right(std::span<const Term> terms) = 0;
  // Adds a row to each unknown. Returns how far that takes the surface, of its size. right: the
  // side that the step solves.
  virtual double Move(const Eigen::MatrixX3d& step, const Eigen::MatrixX3d& right) = 0;
};

// Of one level, whose vertices are `net`. Both must outlive it.
class LevelEquations final : public TermEquations {
 public:
  LevelEquations(const LevelView& view, ControlNet& net) : view_(view), net_(net) {}
  NormalSystem System(std::span<const Term> terms) override;
  Eigen::MatrixX3d Right(std::span<const Term> terms) override;
  double Move(const Eigen::MatrixX3d& step, const Eigen::MatrixX3d& right) override;

  const SparseMatrix& points() const { return points_; }  // of the last system with points, lower

 private:
  const LevelView& view_;
  ControlNet& net_;
  SparseMatrix points_;
};

struct DescentOptions {
  double shift = 0;           // added to the diagonal
  double relative_shift = 0;  // the same, of the diagonal's mean
  double least_move = 1e-13;  // a step that moves the surface no more is the last
  bool reweighted = false;    // the points' weights change with each step, and so does the matrix
  bool one_step = false;
};

// Damped Gauss-Newton steps, each on the residuals themselves, by one Cholesky factor of the scalar
// normal equations for all coordinates and, if not reweighted, all steps.
SolverOutcome Descend(TermEquations& equations, std::span<const Term> terms,
                      const DescentOptions& options);

// Any terms: Ceres, one problem with a block of 3 doubles per vertex, sparse Cholesky, one thread.
SolverOutcome SolveByCeres(const LevelView& view, std::span<const Term> terms, ControlNet& net);

// Separable terms of one level: Descend. The minimiser of SolveByCeres, many times faster, and in
// memory that does not grow with the points.
SolverOutcome SolveDirectly(const LevelView& view, std::span<const Term> terms, ControlNet& net);

// How the surface stands to points and terms.
struct Standing {
  double rms_mm = kNaN;            // of the points, weighted
  std::vector<double> costs = {};  // of each term, mm^2
};
LevelSummary SummaryOf(std::span<const Term> terms, const Standing& before, const Standing& after,
                       const SolverOutcome& outcome);

// What the points alone determine.
struct PointCover {
  SparseMatrix points;            // their normal matrix, lower
  std::size_t count = 0;          // of points
  std::vector<int> patch_counts;  // of the points, one per patch
  int covered = 0;                // unknowns without a row, for finer ones take their place
};
void NoteCoverage(const PointCover& cover, LevelSummary& summary);

}  // namespace semblance
