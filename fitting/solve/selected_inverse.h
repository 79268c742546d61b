// SPDX-License-Identifier: GPL-3.0-or-later
// Some entries of the inverse of a sparse matrix.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

namespace semblance {

// The entries of the inverse of a symmetric positive definite matrix that stand where its Cholesky
// factor has entries, and so wherever the matrix itself has any (Takahashi, Fagan & Chen 1973;
// Erisman & Tinney 1975). Time as that of the factor: the squares of its columns' lengths.
class SelectedInverse {
 public:
  // lower: the matrix's lower triangle.
  explicit SelectedInverse(const Eigen::SparseMatrix<double>& lower);

  bool usable() const { return usable_; }  // false: the matrix is not positive definite
  // Of the inverse; the matrix must have an entry there, be it zero. Row and column in any order.
  double At(int row, int column) const;

 private:
  std::vector<double> TakePattern(const Eigen::SparseMatrix<double>& factor);
  void FillColumn(int j, double pivot, const std::vector<double>& of_factor,
                  std::vector<double>& sums);
  void AddColumn(int a, int begin, int end, const std::vector<double>& of_factor,
                 std::vector<double>& sums) const;

  bool usable_ = false;
  std::vector<int> place_;          // of each row in the factor's order
  std::vector<int> starts_, rows_;  // of the factor's columns; the diagonal first
  std::vector<double> values_;      // of the inverse
};

}  // namespace semblance
