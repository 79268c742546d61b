// SPDX-License-Identifier: GPL-3.0-or-later
// Direct solution of the symmetric equations of a mesh, for many right sides.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// Multifrontal Cholesky: nested dissection leaves small dense matrices, whose products are several
// times as fast as a sparse factorisation by columns.
class MeshSolver {
 public:
  // matrix: positive definite, both triangles. points: one per unknown, where it lies; they give an
  // elimination order, no result but for rounding.
  MeshSolver(const std::vector<Vec3>& points, const Eigen::SparseMatrix<double>& matrix);

  // One solution per column; several at once cost less than one by one.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& right) const;

  // The inverse's entries where `entries` has some, whatever their values: both triangles, and only
  // where the matrix has an entry (or its factor; so vertices and edges of the mesh). By Takahashi,
  // Fagan & Chin (1973), matrix by matrix; costs about twice the factorisation.
  Eigen::SparseMatrix<double> SelectedInverse(Eigen::SparseMatrix<double> entries) const;

  // Unknowns that are eliminated together: those at begin..end-1 in the order, coupled with later
  // ones, the border.
  struct FrontalMatrix {
    int begin = 0, end = 0;
    std::vector<int> border;
    Eigen::MatrixXd own;    // lower triangle of the Cholesky factor
    Eigen::MatrixXd below;  // its rows at the border
  };

 private:
  std::vector<int> order_;
  std::vector<FrontalMatrix> frontals_;
};

}  // namespace semblance
