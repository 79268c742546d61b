// SPDX-License-Identifier: GPL-3.0-or-later
// Solves symmetric positive definite equations on a mesh directly, for many right sides.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::interp {

// A multifrontal Cholesky factorisation. Nested dissection leaves small dense matrices, whose
// products are several times as fast as a sparse factorisation by columns.
class MeshSolver {
 public:
  // matrix: positive definite, with both triangles. points: the place of each unknown, which
  // determines only the order of elimination.
  MeshSolver(const std::vector<Vec3>& points, const Eigen::SparseMatrix<double>& matrix);

  // Solves for each column of `right`. Several columns at once cost less than single ones.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& right) const;

  // Computes the entries of the inverse at the nonzeros of `entries` (both triangles), which must
  // be nonzeros of the matrix or its factor, such as vertices and edges of the mesh. The method of
  // Takahashi, Fagan & Chin (1973), applied to the frontal matrices, costs about twice the
  // factorisation.
  Eigen::SparseMatrix<double> SelectedInverse(Eigen::SparseMatrix<double> entries) const;

  // Unknowns that are eliminated together: the positions begin .. end - 1 of the order. The border
  // consists of the later unknowns that are coupled with them.
  struct FrontalMatrix {
    int begin = 0, end = 0;
    std::vector<int> border;
    Eigen::MatrixXd own;    // lower triangle of the Cholesky factor's diagonal block
    Eigen::MatrixXd below;  // the factor's rows at the border
  };

 private:
  std::vector<int> order_;
  std::vector<FrontalMatrix> frontals_;
};

}  // namespace semblance::interp
