// SPDX-License-Identifier: GPL-3.0-or-later
// The normal equations of linear terms over one control net, one scalar matrix for x, y and z.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <span>
#include <vector>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/least_squares/row_sink.h"
#include "surfaces/hspline/control_net.h"

namespace semblance {

using SparseMatrix = Eigen::SparseMatrix<double>;

// In steps from where a surface stands, the same matrix for x, y and z.
struct NormalSystem {
  SparseMatrix lower;      // triangle
  Eigen::MatrixX3d right;  // unknowns x 3: half of minus the gradient
};

// Adds A^T A of each block of rows; patches find the place of their entries prepared.
class NormalMatrix final : public RowSink {
 public:
  explicit NormalMatrix(const PatchGrid& grid);
  void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
           std::span<const int> vertices) override;
  SparseMatrix Lower() const;  // the lower triangle

 private:
  void AddEntry(int row, int column, double value);

  SparseMatrix patches_;
  std::vector<Eigen::Triplet<double>> others_;  // between vertices that share no patch
  std::shared_ptr<const Eigen::MatrixXd> last_;
  Eigen::MatrixXd gram_;  // of last_
};

// Adds A^T (B - A X) of each block of rows, at a net X: half of minus the gradient. The misfit is
// taken row by row, which is more precise than the difference of A^T B and A^T A X.
class NormalResidual final : public RowSink {
 public:
  explicit NormalResidual(const ControlNet& net);
  void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
           std::span<const int> vertices) override;
  const Eigen::MatrixX3d& Sum() const { return sum_; }  // vertices x 3

 private:
  const ControlNet& net_;
  Eigen::MatrixX3d sum_;
};

}  // namespace semblance
