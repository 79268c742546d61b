// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/selected_inverse.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <stdexcept>
#include <utility>

namespace semblance {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Factor = Eigen::SimplicialLDLT<Matrix, Eigen::Lower>;

}  // namespace

SelectedInverse::SelectedInverse(const Matrix& lower) {
  const Factor factor(lower);
  usable_ = factor.info() == Eigen::Success && factor.vectorD().minCoeff() > 0;
  if (!usable_) {
    return;
  }
  const auto& order = factor.permutationP().indices();
  place_.assign(order.begin(), order.end());
  const std::vector<double> of_factor = StorePattern(factor.matrixL());
  values_.assign(rows_.size(), 0);
  std::vector<double> sums(place_.size(), 0);
  for (int j = static_cast<int>(place_.size()) - 1; j >= 0; --j) {
    FillColumn(j, factor.vectorD()[j], of_factor, sums);
  }
}

// Stores the factor's pattern, and returns its entries including those of its diagonal, which
// are 1.
std::vector<double> SelectedInverse::StorePattern(const Matrix& factor) {
  std::vector<double> entries;
  starts_.push_back(0);
  for (int j = 0; j < factor.cols(); ++j) {
    rows_.push_back(j);
    entries.push_back(1);
    for (Matrix::InnerIterator entry(factor, j); entry; ++entry) {
      if (entry.row() > j) {
        rows_.push_back(static_cast<int>(entry.row()));
        entries.push_back(entry.value());
      }
    }
    starts_.push_back(static_cast<int>(rows_.size()));
  }
  return entries;
}

// With H = L D L^T (L with unit diagonal) the inverse Z satisfies Z = D^-1 L^-1 + (I - L^T) Z.
// Columns are computed from the last: Z_ij = -sum_k L_kj Z_ik for i > j, and Z_jj = 1 / D_j - sum_k
// L_kj Z_kj, summed over the rows k > j of L's column j. By fill-in, L has an entry for any two of
// those rows.
void SelectedInverse::FillColumn(int j, double pivot, const std::vector<double>& of_factor,
                                 std::vector<double>& sums) {
  const int begin = starts_[j] + 1, end = starts_[j + 1];
  for (int a = begin; a < end; ++a) {
    sums[rows_[a]] = 0;
  }
  for (int a = begin; a < end; ++a) {
    AddColumn(a, begin, end, of_factor, sums);
  }
  double diagonal = 1 / pivot;
  for (int a = begin; a < end; ++a) {
    values_[a] = -sums[rows_[a]];
    diagonal -= of_factor[a] * values_[a];
  }
  values_[starts_[j]] = diagonal;
}

// Adds the contributions of the inverse's column k, where k is the row at `a` among begin .. end
// - 1. Each pair of those rows is visited once and contributes to both.
void SelectedInverse::AddColumn(int a, int begin, int end, const std::vector<double>& of_factor,
                                std::vector<double>& sums) const {
  const int k = rows_[a];
  int at = begin;
  for (int b = starts_[k]; b < starts_[k + 1]; ++b) {
    while (at < end && rows_[at] < rows_[b]) {
      ++at;
    }
    if (at == end) {
      return;
    }
    if (rows_[at] == rows_[b]) {
      sums[rows_[b]] += of_factor[a] * values_[b];
      sums[k] += rows_[b] != k ? of_factor[at] * values_[b] : 0;
    }
  }
}

double SelectedInverse::At(int row, int column) const {
  const auto [first, second] = std::minmax(place_[row], place_[column]);
  const auto begin = rows_.begin() + starts_[first], end = rows_.begin() + starts_[first + 1];
  const auto found = std::lower_bound(begin, end, second);
  if (found == end || *found != second) {
    throw std::logic_error("selected inverse: the matrix has no entry there");
  }
  return values_[static_cast<std::size_t>(found - rows_.begin())];
}

}  // namespace semblance
