// SPDX-License-Identifier: GPL-3.0-or-later
// Where the linear terms of a level's solve put their rows.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>

namespace semblance {

using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

// Takes rows A X - B that are to be small in the sense of least squares, the same A for x, y and z.
class RowSink {
 public:
  virtual ~RowSink() = default;
  // a: rows x vertices, without unit or as its term scales it; b: rows x 3, mm; `vertices` names
  // the control vertex of each column, one may appear twice.
  virtual void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                   std::span<const int> vertices) = 0;
};

}  // namespace semblance
