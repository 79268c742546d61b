// SPDX-License-Identifier: GPL-3.0-or-later
// Selected entries of the inverse of a sparse matrix.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

namespace semblance {

// The entries of the inverse of a symmetric positive definite matrix at the places of its Cholesky
// factor's entries, which include those of the matrix (Takahashi, Fagan & Chen 1973; Erisman &
// Tinney 1975). The time is that of the factor: proportional to the sum of the squared lengths of
// its columns.
class SelectedInverse {
 public:
  // lower: the matrix's lower triangle.
  explicit SelectedInverse(const Eigen::SparseMatrix<double>& lower);

  bool usable() const { return usable_; }  // false: the matrix is not positive definite
  // An entry of the inverse. The matrix must have an entry there, even if its value is zero. Row
  // and column may be swapped. Throws std::logic_error for other places.
  double At(int row, int column) const;

 private:
  std::vector<double> StorePattern(const Eigen::SparseMatrix<double>& factor);
  void FillColumn(int j, double pivot, const std::vector<double>& of_factor,
                  std::vector<double>& sums);
  void AddColumn(int a, int begin, int end, const std::vector<double>& of_factor,
                 std::vector<double>& sums) const;

  bool usable_ = false;
  std::vector<int> place_;          // place of each row in the factor's order
  std::vector<int> starts_, rows_;  // pattern of the factor's columns; the diagonal first
  std::vector<double> values_;      // entries of the inverse
};

}  // namespace semblance
