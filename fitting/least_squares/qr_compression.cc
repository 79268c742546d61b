// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/qr_compression.h"

#include <Eigen/Householder>
#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <utility>

namespace semblance::fitting {
namespace {

// Rows; 128 x 19 doubles (19 kB) fit into the first-level cache.
constexpr Eigen::Index kSlab = 128;

// Makes the first `unknowns` columns of the top `rows` rows upper triangular by Householder
// reflections.
void Triangulate(Eigen::Index rows, Eigen::Index unknowns, Eigen::MatrixXd& slab) {
  Eigen::VectorXd workspace(slab.cols());
  for (Eigen::Index k = 0; k < std::min(unknowns, rows - 1); ++k) {
    double tau = 0, beta = 0;
    slab.col(k).segment(k, rows - k).makeHouseholderInPlace(tau, beta);
    const Eigen::VectorXd essential = slab.col(k).segment(k + 1, rows - k - 1);
    slab.block(k, k + 1, rows - k, slab.cols() - k - 1)
        .applyHouseholderOnTheLeft(essential, tau, workspace.data());
    slab(k, k) = beta;
    slab.col(k).segment(k + 1, rows - k - 1).setZero();
  }
}

// The top unknowns x (unknowns + 3) of the triangulated [A | B].
Eigen::MatrixXd UpperTriangle(const Eigen::MatrixXd& a, const Rows3& b) {
  const Eigen::Index n = a.cols();
  Eigen::MatrixXd slab(std::min(a.rows(), std::max(kSlab, 2 * n)), n + 3);
  Eigen::Index filled = 0;
  for (Eigen::Index done = 0; done < a.rows();) {
    const Eigen::Index count = std::min(slab.rows() - filled, a.rows() - done);
    slab.block(filled, 0, count, n) = a.middleRows(done, count);
    slab.block(filled, n, count, 3) = b.middleRows(done, count);
    Triangulate(filled + count, n, slab);
    filled = std::min(n, filled + count);
    done += count;
  }
  return slab.topRows(n);
}

// Drops the rows beyond the rank by a pivoted decomposition. They hold only rounding, and would
// pull the solution by the misfit that is left in them.
LinearRows TruncateRank(LinearRows rows) {
  const Eigen::VectorXd diagonal = rows.a.diagonal().cwiseAbs();
  if (diagonal.minCoeff() > 1e-10 * diagonal.maxCoeff()) {
    return rows;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows.a.rows(), rows.a.cols());
  qr.setThreshold(64 * std::numeric_limits<double>::epsilon());
  qr.compute(rows.a);
  const Eigen::Index rank = qr.rank();
  const Eigen::MatrixXd r = qr.matrixR().topRows(rank).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd b = qr.householderQ().adjoint() * rows.b;
  return {.a = r * qr.colsPermutation().transpose(), .b = b.topRows(rank)};
}

}  // namespace

LinearRows CompressRows(const Eigen::MatrixXd& a, const Rows3& b) {
  if (a.rows() <= a.cols()) {
    return {.a = a, .b = b};
  }
  const Eigen::MatrixXd triangle = UpperTriangle(a, b);
  return TruncateRank({.a = triangle.leftCols(a.cols()), .b = triangle.rightCols<3>()});
}

void CompressShared(std::shared_ptr<const Eigen::MatrixXd>& a, Rows3& b) {
  if (a->rows() > a->cols()) {
    LinearRows rows = CompressRows(*a, b);
    a = std::make_shared<const Eigen::MatrixXd>(std::move(rows.a));
    b = std::move(rows.b);
  }
}

}  // namespace semblance::fitting
