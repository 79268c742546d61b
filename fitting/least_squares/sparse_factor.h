// SPDX-License-Identifier: GPL-3.0-or-later
// The sparse Cholesky factor of symmetric matrices.
#pragma once

#include <Eigen/SparseCore>
#include <memory>

namespace semblance {

using SparseMatrix = Eigen::SparseMatrix<double>;

// What a row of a matrix stands for.
enum class RowKind {
  kUnknown,
  kCoordinate,  // row 3 v + c: of vertex v; those of two vertices meet in all nine entries or none
};

// Of `lower` (the lower triangle of a positive semidefinite matrix) + shift times the identity;
// CHOLMOD, one thread.
class SparseFactor {
 public:
  SparseFactor(const SparseMatrix& lower, double shift, RowKind rows = RowKind::kUnknown);
  ~SparseFactor();
  bool usable() const;  // false: not positive definite
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& right) const;
  Eigen::VectorXd Pivots() const;  // squares of the factor's diagonal, in its own order
  double LogDeterminant() const;

 private:
  struct Cholmod;
  std::unique_ptr<Cholmod> cholmod_;
};

// Estimated rank of the matrix whose normal matrix `lower` is; it has so many rows. With its
// columns scaled to length 1, those directions count whose squares exceed some 1e-10. -1 if
// rounding leaves no factor, as with a number that is not finite.
int NumericalRank(const SparseMatrix& lower, std::size_t rows);

// For what this thread calls next. OpenBLAS, where the sparse Cholesky uses it, sums in an order
// that depends on its number of threads, and so on the machine: one thread gives the same bytes
// everywhere (and small blocks gain nothing from more). CHOLMOD would start four of OpenMP however
// many are asked for, and OpenMP ends the program where the system gives none. Both are looked up
// at run time, for other libraries have no such functions.
void UseOneLibraryThread();

}  // namespace semblance
