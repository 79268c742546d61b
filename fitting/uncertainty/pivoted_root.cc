// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/uncertainty/pivoted_root.h"

#include <cmath>

namespace semblance {

Eigen::MatrixXd PivotedRoot(Eigen::MatrixXd left, double share) {
  const Eigen::Index n = left.rows();
  Eigen::MatrixXd root(n, n);
  Eigen::Index rank = 0;
  const double enough = n > 0 ? share * left.diagonal().maxCoeff() : 0;
  for (; rank < n; ++rank) {
    Eigen::Index pivot = 0;
    const double largest = left.diagonal().maxCoeff(&pivot);
    if (!(largest > enough)) {
      break;
    }
    root.col(rank) = left.col(pivot) / std::sqrt(largest);
    left.noalias() -= root.col(rank) * root.col(rank).transpose();
  }
  return root.leftCols(rank);
}

}  // namespace semblance
