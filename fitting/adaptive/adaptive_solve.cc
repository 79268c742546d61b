// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/adaptive/adaptive_solve.h"

#include "fitting/adaptive/refinement_marking.h"

namespace semblance {

AdaptiveSolve::AdaptiveSolve(const HSplineSurface& start, const HSplineSurface& rest,
                             const FitTarget& target, std::span<const Term> terms,
                             LevelSolver solver, int threads)
    : target_(target),
      cloud_(start.shape(), target),
      space_(start, rest, cloud_),
      points_(PointsOf(terms), cloud_, space_, threads),
      solver_({.rest = rest,
               .cloud = cloud_,
               .target = target,
               .space = space_,
               .points = points_,
               .solver = solver},
              terms) {
  points_.Measure();
}

void AdaptiveSolve::SeePoints() {
  cloud_ = PointCloud(space_.shape(), target_);
  space_.Rebin();
  points_.Measure();
}

bool AdaptiveSolve::Refine(const AdaptivePlan& plan) {
  const std::vector<VertexId> finer = MarkForRefinement(space_, plan);
  if (finer.empty()) {
    return false;
  }
  space_.Edit(finer);
  points_.Measure();
  return true;
}

LevelSummary AdaptiveSolve::Settle() {
  points_.Settle();
  points_.Measure();
  LevelSummary summary = solver_.Solve(SolveTolerance::kTight);
  solver_.MeasureCoverage(summary);
  return summary;
}

}  // namespace semblance
