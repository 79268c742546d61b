// SPDX-License-Identifier: GPL-3.0-or-later
// The term `points` of an adaptive fit, with its loss.
#pragma once

#include <vector>

#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/space/point_cloud.h"
#include "fitting/terms/term.h"

namespace semblance {

// Keeps the space measured, its points weighted by what the loss makes of their distances.
class RobustPointResiduals {
 public:
  RobustPointResiduals(const PointTerm& term, const PointCloud& cloud,
                       HierarchicalSplineSpace& space, int threads)
      : term_(term), cloud_(cloud), space_(space), threads_(threads) {}

  // With a loss: first the distances, then the sums with the weights that follow from them.
  void Measure();
  // From now on the loss is as wide as the term has it; before, where the surface is still far from
  // most points, at least three times their median distance, so that it does not take them for
  // outliers.
  void Settle() { settled_ = true; }

  bool HasLoss() const { return term_.loss != RobustLoss::kNone; }
  double weight() const { return term_.weight; }
  double Scale() const { return term_.weight / cloud_.weight_sum(); }  // of w |e|^2 in the cost
  // What the width of the loss is at least, now.
  double LeastLossWidth_mm() const;
  double Rms() const;   // mm, weighted, without the loss's factors
  double Cost() const;  // of the term, mm^2

 private:
  PointTerm term_;
  const PointCloud& cloud_;
  HierarchicalSplineSpace& space_;
  int threads_;
  std::vector<double> squares_, factors_;  // with a loss, in the cloud's order
  bool settled_ = false;
  double rms_mm_ = kNaN;  // with a loss
};

}  // namespace semblance
