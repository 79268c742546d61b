// SPDX-License-Identifier: GPL-3.0-or-later
// A sparse lower triangle, summed entry by entry or block by block.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "fitting/least_squares/sparse_factor.h"
#include "surfaces/base/geometry.h"

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

// The same over the coordinates of vertices, coordinate c of vertex v at row 3 v + c. It looks a
// block up where it would sort nine entries.
class BlockTriangleSum {
 public:
  explicit BlockTriangleSum(std::size_t vertices) : columns_(vertices) {}

  // row >= column, of vertices. Of a block on the diagonal the lower triangle counts.
  void Add(int row, int column, const Mat3& block) {
    auto& [rows, blocks] = columns_[column];
    const auto found = std::find(rows.begin(), rows.end(), row);
    if (found != rows.end()) {
      blocks[found - rows.begin()] += block;
    } else {
      rows.push_back(row);
      blocks.push_back(block);
    }
  }

  SparseMatrix Take() const {
    const auto size = static_cast<Eigen::Index>(3 * columns_.size());
    SparseMatrix sum(size, size);
    sum.reserve(std::accumulate(columns_.begin(), columns_.end(), Eigen::Index{0},
                                [](Eigen::Index entries, const Column& column) {
                                  return entries + 9 * std::ssize(column.rows);
                                }));
    for (std::size_t v = 0; v < columns_.size(); ++v) {
      AppendColumns(static_cast<int>(v), sum);
    }
    sum.finalize();
    return sum;
  }

 private:
  struct Column {
    std::vector<int> rows;
    std::vector<Mat3> blocks;
  };

  void AppendColumns(int vertex, SparseMatrix& sum) const {
    const auto& [rows, blocks] = columns_[vertex];
    std::vector<int> order(rows.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) { return rows[a] < rows[b]; });
    for (int c = 0; c < 3; ++c) {
      sum.startVec(3 * vertex + c);
      for (const int k : order) {
        for (int r = rows[k] == vertex ? c : 0; r < 3; ++r) {
          sum.insertBack(3 * rows[k] + r, 3 * vertex + c) = blocks[k](r, c);
        }
      }
    }
  }

  std::vector<Column> columns_;
};

}  // namespace semblance
