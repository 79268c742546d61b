// SPDX-License-Identifier: GPL-3.0-or-later
// All levels of a surface solved for at once, again and again on finer vertices (AdaptivePlan).
#pragma once

#include <span>
#include <vector>

#include "fitting/level/level_solver.h"
#include "fitting/problem/fit_schedule.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/space/point_cloud.h"

namespace semblance {

// How far a step may move the surface, root mean square, of the size of the net of level 0, and be
// the last. How far it moves the dofs says nothing where a coarse vertex is a sum of finer
// ones.
enum class SolveTolerance { kLoose, kTight };

// Two ways to the same minimum. With `fastest`, and no terms but points, smoothness and membrane:
// Descend on the normal equations, assembled from moments of each leaf's points; a loss by
// iterative reweighting. Else Minimise with a view of all levels.
class AdaptiveSolve final : private TermEquations {
 public:
  // start and rest: of one shape. All but the terms must outlive it; among them are points with a
  // weight (fit_check.h). Throws InputError for more than one `weight: auto`, and for a template
  // without extent where a term needs it.
  AdaptiveSolve(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
                std::span<const Term> terms, LevelSolver solver, int threads);

  // After the target's points have moved.
  void SeePoints();
  // Chooses `weight: auto`, then goes to the minimum.
  LevelSummary Solve(SolveTolerance until);
  // Adds the vertices that the plan asks for; false if there are none.
  bool Refine(const AdaptivePlan& plan);
  // The last solve, tight, with what the points determine of it. From now on a loss is as wide as
  // its term has it; before, where the surface is still far from most points, at least three times
  // their median distance, so that it does not take them for outliers.
  LevelSummary Settle();

  HSplineSurface Surface() const { return space_.Surface(); }
  int dofs() const { return static_cast<int>(space_.dofs().size()); }
  int finest() const { return space_.finest(); }

 private:
  NormalSystem System(std::span<const Term> terms) override;
  Eigen::MatrixX3d Right(std::span<const Term> terms) override { return System(terms).right; }
  double Move(const Eigen::MatrixX3d& step, const Eigen::MatrixX3d& right) override;

  void Take(const Eigen::MatrixX3d& step);
  void Measure();
  double ChooseSmoothness();
  bool GoesDirectly() const;
  SolverOutcome SolveWithCeres(SolveTolerance until);
  LevelView View() const { return ViewOfSpace(space_, cloud_, target_, lengths_mm_); }
  Standing Stand() const;
  double LeastLossWidth_mm() const;
  double PointCost() const;
  bool HasLoss() const { return points_.loss != RobustLoss::kNone; }
  double Scale() const { return points_.weight / cloud_.weight_sum(); }  // of w |e|^2 in the cost
  double Rms() const;

  const FitTarget& target_;
  PointCloud cloud_;
  HierarchicalSplineSpace space_;  // measured, its points weighted by what the loss makes of them
  std::vector<Term> terms_;        // with the weight that was chosen last
  PointTerm points_;               // among them
  int auto_term_;                  // or -1
  LevelSolver solver_;
  int threads_;
  Vec2 lengths_mm_;
  double chosen_ = 0;                      // weight; 0: none yet
  double max_move_mm_ = 0;                 // of a dof, in the solve at hand
  bool settled_ = false;                   // the loss is as wide as it will be
  double rms_mm_ = kNaN;                   // without the loss's factors; with a loss
  std::vector<double> squares_, factors_;  // with a loss, in the cloud's order
};

}  // namespace semblance
