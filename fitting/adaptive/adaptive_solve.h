// SPDX-License-Identifier: GPL-3.0-or-later
// All levels of a surface solved for at once, again and again on finer vertices (AdaptivePlan).
#pragma once

#include <span>
#include <vector>

#include "fitting/adaptive/space_solver.h"
#include "fitting/problem/fit_schedule.h"

namespace semblance {

class AdaptiveSolve {
 public:
  // start and rest: of one shape. All but the terms must outlive it. Throws InputError as
  // SpaceSolver.
  AdaptiveSolve(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
                std::span<const Term> terms, LevelSolver solver, int threads);

  // After the target's points have moved.
  void SeePoints();
  LevelSummary Solve(SolveTolerance until) { return solver_.Solve(until); }
  // Adds the vertices that the plan asks for; false if there are none.
  bool Refine(const AdaptivePlan& plan);
  // The last solve, tight, with what the points determine of it.
  LevelSummary Settle();

  HSplineSurface Surface() const { return space_.Surface(); }
  int dofs() const { return static_cast<int>(space_.dofs().size()); }
  int finest() const { return space_.finest(); }

 private:
  const FitTarget& target_;
  PointCloud cloud_;
  HierarchicalSplineSpace space_;
  RobustPointResiduals points_;
  SpaceSolver solver_;
};

}  // namespace semblance
