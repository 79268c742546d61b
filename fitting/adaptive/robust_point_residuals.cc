// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/adaptive/robust_point_residuals.h"

#include <algorithm>
#include <cmath>

#include "fitting/terms/robust_loss.h"

namespace semblance {
namespace {

double RmsOf(const OffsetTree& tree, const PointCloud& cloud) {
  return std::sqrt(tree.Squares() / cloud.weight_sum());
}

}  // namespace

void RobustPointResiduals::Measure() {
  if (!HasLoss()) {
    tree_.Measure({}, threads_, nullptr);
    return;
  }
  tree_.Measure({}, threads_, &squares_);
  rms_mm_ = RmsOf(tree_, cloud_);
  PointTerm loss = term_;
  loss.loss_width_mm = std::max(loss.loss_width_mm, LeastWidth());
  factors_.resize(squares_.size());
  for (std::size_t k = 0; k < squares_.size(); ++k) {
    factors_[k] = RhoSlope(loss, squares_[k]);
  }
  tree_.Measure(factors_, threads_, nullptr);
}

double RobustPointResiduals::LeastWidth() const {
  if (settled_) {
    return 0;
  }
  std::vector<double> squares = squares_;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return 3 * std::sqrt(*middle);
}

double RobustPointResiduals::Rms() const { return HasLoss() ? rms_mm_ : RmsOf(tree_, cloud_); }

double RobustPointResiduals::Cost() const {
  if (!HasLoss()) {
    return Scale() * tree_.Squares();
  }
  double sum = 0;
  for (std::size_t k = 0; k < squares_.size(); ++k) {
    sum += cloud_.points()[k].weight * Rho(term_, squares_[k]);
  }
  return Scale() * sum;
}

}  // namespace semblance
