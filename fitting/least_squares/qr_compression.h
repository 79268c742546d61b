// SPDX-License-Identifier: GPL-3.0-or-later
// Many rows of a least-squares problem in few unknowns as few rows.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "fitting/least_squares/row_sink.h"

namespace semblance {

struct LinearRows {
  Eigen::MatrixXd a;  // rows x unknowns
  Rows3 b;            // rows x 3
};

// At most a.cols() rows whose sum of squares |A X - B|^2 differs from the given one by the same
// constant for every X, and so has the same gradient and minimisers: the R of a QR decomposition,
// made a slab of rows at a time. Rows that carry nothing (rank below a.cols()) are left out. No
// more rows than columns come back as they are.
LinearRows CompressRows(const Eigen::MatrixXd& a, const Rows3& b);

// The same in place, as a RowSink takes rows; no more rows than columns stay shared.
void CompressShared(std::shared_ptr<const Eigen::MatrixXd>& a, Rows3& b);

}  // namespace semblance
