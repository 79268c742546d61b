// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of linear least-squares problems, and their compression: many rows in few unknowns become
// few rows.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>

namespace semblance::fitting {

using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

// Receives the rows A X - B of a least-squares problem; A is the same for x, y and z.
class RowSink {
 public:
  virtual ~RowSink() = default;
  // a: rows x vertices, scaled by its term; b: rows x 3, mm; vertices: the control vertex of each
  // column. A vertex may appear twice.
  virtual void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                   std::span<const int> vertices) = 0;
};

struct LinearRows {
  Eigen::MatrixXd a;  // rows x unknowns
  Rows3 b;            // rows x 3
};

// Returns at most a.cols() rows whose sum of squares |A X - B|^2 differs from the given one by the
// same constant for every X, and so has the same gradient and minimisers. They are the R of a QR
// decomposition, computed one slab of rows at a time. Rows beyond the rank are dropped. A block
// with no more rows than columns is returned unchanged.
LinearRows CompressRows(const Eigen::MatrixXd& a, const Rows3& b);

// Compresses in place, in the form that a RowSink receives. A block with no more rows than columns
// stays shared.
void CompressShared(std::shared_ptr<const Eigen::MatrixXd>& a, Rows3& b);

}  // namespace semblance::fitting
