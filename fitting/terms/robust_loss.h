// SPDX-License-Identifier: GPL-3.0-or-later
// The losses of PointTerm; the same formulas as those of Ceres.
#pragma once

#include <algorithm>
#include <cmath>

#include "fitting/terms/term.h"

namespace semblance {

// rho(s) of a squared distance s, mm^2.
inline double Rho(const PointTerm& term, double s) {
  const double a = term.loss_width_mm;
  switch (term.loss) {
    case RobustLoss::kHuber:
      return s <= a * a ? s : 2 * a * std::sqrt(s) - a * a;
    case RobustLoss::kCauchy:
      return a * a * std::log1p(s / (a * a));
    case RobustLoss::kTukey:
      return a * a / 3 * (1 - std::pow(std::max(1 - s / (a * a), 0.0), 3));
    case RobustLoss::kNone:
      break;
  }
  return s;
}

// rho'(s), 1 at 0: the factor of a point's weight in iteratively reweighted least squares.
inline double RhoSlope(const PointTerm& term, double s) {
  const double a = term.loss_width_mm;
  switch (term.loss) {
    case RobustLoss::kHuber:
      return s <= a * a ? 1 : a / std::sqrt(s);
    case RobustLoss::kCauchy:
      return 1 / (1 + s / (a * a));
    case RobustLoss::kTukey:
      return std::pow(std::max(1 - s / (a * a), 0.0), 2);
    case RobustLoss::kNone:
      break;
  }
  return 1;
}

}  // namespace semblance
