// SPDX-License-Identifier: GPL-3.0-or-later
// A covariance as the few directions that it is made of.
#pragma once

#include <Eigen/Core>

namespace semblance {

// A root as PointErrors takes it of a positive semidefinite matrix: its Cholesky factor with
// pivots, cut off where what is left of each variance is below `share` of the largest (Harbrecht,
// Peters & Schneider 2012).
Eigen::MatrixXd PivotedRoot(Eigen::MatrixXd covariance, double share = 1e-3);

}  // namespace semblance
