// SPDX-License-Identifier: GPL-3.0-or-later
// A sparse lower triangle, summed entry by entry.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "fitting/least_squares/sparse_factor.h"

namespace semblance {

// Entries wait as triplets, never more than 16 MB of them, and are then added to the sum.
class TriangleSum {
 public:
  explicit TriangleSum(Eigen::Index rows) : sum_(rows, rows) {}

  // row >= column.
  void Add(int row, int column, double value) {
    waiting_.emplace_back(row, column, value);
    if (waiting_.size() == kMost) {
      Flush();
    }
  }

  SparseMatrix Take() {
    Flush();
    return std::move(sum_);
  }

 private:
  static constexpr std::size_t kMost = 1 << 20;

  void Flush() {
    SparseMatrix part(sum_.rows(), sum_.cols());
    part.setFromTriplets(waiting_.begin(), waiting_.end());
    waiting_.clear();
    if (sum_.nonZeros() == 0) {
      sum_.swap(part);
    } else {
      sum_ += part;
    }
  }

  SparseMatrix sum_;
  std::vector<Eigen::Triplet<double>> waiting_;
};

}  // namespace semblance
