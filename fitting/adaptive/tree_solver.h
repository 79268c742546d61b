// SPDX-License-Identifier: GPL-3.0-or-later
// Solves for all unknowns of an OffsetTree at once.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fitting/adaptive/robust_point_residuals.h"
#include "fitting/adaptive/tree_system.h"
#include "fitting/least_squares/sparse_factor.h"
#include "fitting/level/level_fit.h"

namespace semblance {

// The points of `terms`, if there is one such term with a weight and no other than smoothness and
// membrane beside it; else InputError.
PointTerm PointsOf(std::span<const Term> terms);

// How far a step may move the surface, root mean square, of the size of the net of level 0, and be
// the last. How far it moves the unknowns says nothing where a coarse vertex is a sum of finer
// ones.
enum class SolveTolerance { kLoose, kTight };

class TreeSolver {
 public:
  // rest: the placed template. InputError as PointsOf, for more than one `weight: auto`, and for a
  // template without extent where a term needs it.
  TreeSolver(const HSplineSurface& rest, std::span<const Term> terms, const PointCloud& cloud,
             OffsetTree& tree, RobustPointResiduals& points);

  // Chooses `weight: auto`, then Gauss-Newton steps, each on the residuals themselves, until they
  // are small. The tree must be measured, and then is.
  LevelSummary Solve(SolveTolerance until);

  // What the points alone determine.
  void MeasureCoverage(LevelSummary& summary) const;

 private:
  double ChooseSmoothness();
  double Step(std::optional<SparseFactor>& factor, LevelSummary& summary);
  std::vector<TermCosts> Costs() const;

  std::vector<Term> terms_;  // with the weight that was chosen last
  int auto_term_;            // among them, or -1
  const PointCloud& cloud_;
  OffsetTree& tree_;
  RobustPointResiduals& points_;
  Vec2 lengths_mm_;
  std::vector<LevelForms> forms_;  // none without smoothness
  double chosen_ = 0;              // weight; 0: none yet
};

}  // namespace semblance
