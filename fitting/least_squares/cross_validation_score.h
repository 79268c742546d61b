// SPDX-License-Identifier: GPL-3.0-or-later
// Generalised cross-validation.
#pragma once

#include <algorithm>

#include "surfaces/base/geometry.h"

namespace semblance {

// misfit / (1 - trace / count)^2, least where each point is best predicted by the others (Craven &
// Wahba 1979). misfit: the squared residuals' sum or mean, below 0 by rounding alone; trace: of the
// influence matrix; count: of points. NaN where no more than `least_left` of the points' freedom
// remains: so little is the trace's rounding, or the error of its estimate.
inline double CrossValidationScore(double misfit, double trace, double count,
                                   double least_left = 1e-6) {
  const double left = 1 - trace / count;
  return left > least_left ? std::max(misfit, 0.0) / (left * left) : kNaN;
}

}  // namespace semblance
