// SPDX-License-Identifier: GPL-3.0-or-later
// Solves for all dofs of an HierarchicalSplineSpace at once.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fitting/adaptive/robust_point_residuals.h"
#include "fitting/adaptive/space_system.h"
#include "fitting/least_squares/sparse_factor.h"
#include "fitting/level/level_fit.h"
#include "fitting/level/level_solver.h"
#include "fitting/terms/level_view.h"

namespace semblance {

// The term `points` among the terms; there is one with a weight (fit_check.h).
PointTerm PointsOf(std::span<const Term> terms);

// How far a step may move the surface, root mean square, of the size of the net of level 0, and be
// the last. How far it moves the dofs says nothing where a coarse vertex is a sum of finer
// ones.
enum class SolveTolerance { kLoose, kTight };

// What all solves of one fit share.
struct SpaceProblem {
  const HSplineSurface& rest;  // the placed template
  const PointCloud& cloud;     // of the target's points
  const FitTarget& target;
  HierarchicalSplineSpace& space;
  RobustPointResiduals& points;
  LevelSolver solver = LevelSolver::kCeres;
};

// Two ways to the same minimum. With `fastest`, and no terms but points, smoothness and membrane:
// one Cholesky factor of the normal equations, assembled from moments of each leaf's points; a loss
// by iterative reweighting. Else a ceres::Problem whose parameter blocks are the dofs: in tiles of
// 3 x 3 vertices of a level where the terms treat x, y and z alike, else one per vertex; the points
// of a leaf are reduced to at most sixteen rows.
class SpaceSolver {
 public:
  // All but the terms must outlive it. Throws InputError for more than one `weight: auto`, and for
  // a template without extent where a term needs it.
  SpaceSolver(const SpaceProblem& problem, std::span<const Term> terms);

  // Chooses `weight: auto`, then goes to the minimum. The space must be measured, and then is.
  LevelSummary Solve(SolveTolerance until);

  // What the points alone determine.
  void MeasureCoverage(LevelSummary& summary) const;

 private:
  double ChooseSmoothness();
  bool GoesDirectly() const;
  void SolveDirectly(SolveTolerance until, LevelSummary& summary);
  void SolveWithCeres(SolveTolerance until, LevelSummary& summary);
  double Step(std::optional<SparseFactor>& factor, LevelSummary& summary);
  LevelView View() const;
  std::vector<double> Costs() const;  // of each term, at the surface as it stands

  SpaceProblem problem_;
  std::vector<Term> terms_;  // with the weight that was chosen last
  int auto_term_;            // among them, or -1
  const PointCloud& cloud_;
  HierarchicalSplineSpace& space_;
  RobustPointResiduals& points_;
  Vec2 lengths_mm_;
  std::vector<LevelStiffness> forms_;  // none without smoothness
  double chosen_ = 0;                  // weight; 0: none yet
};

}  // namespace semblance
