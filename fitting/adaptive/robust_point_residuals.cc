// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/adaptive/robust_point_residuals.h"

#include <algorithm>
#include <cmath>

#include "fitting/terms/robust_loss.h"

namespace semblance {
namespace {

double RmsOf(const HierarchicalSplineSpace& space, const PointCloud& cloud) {
  return std::sqrt(space.Squares() / cloud.weight_sum());
}

}  // namespace

void RobustPointResiduals::Measure() {
  if (!HasLoss()) {
    space_.Measure({}, threads_, nullptr);
    return;
  }
  space_.Measure({}, threads_, &squares_);
  rms_mm_ = RmsOf(space_, cloud_);
  PointTerm loss = term_;
  loss.loss_width_mm = std::max(loss.loss_width_mm, LeastLossWidth_mm());
  factors_.resize(squares_.size());
  for (std::size_t k = 0; k < squares_.size(); ++k) {
    factors_[k] = RhoSlope(loss, squares_[k]);
  }
  space_.Measure(factors_, threads_, nullptr);
}

double RobustPointResiduals::LeastLossWidth_mm() const {
  if (settled_ || !HasLoss()) {
    return 0;
  }
  std::vector<double> squares = squares_;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return 3 * std::sqrt(*middle);
}

double RobustPointResiduals::Rms() const { return HasLoss() ? rms_mm_ : RmsOf(space_, cloud_); }

double RobustPointResiduals::Cost() const {
  if (!HasLoss()) {
    return Scale() * space_.Squares();
  }
  double sum = 0;
  for (std::size_t k = 0; k < squares_.size(); ++k) {
    sum += cloud_.points()[k].weight * Rho(term_, squares_[k]);
  }
  return Scale() * sum;
}

}  // namespace semblance
