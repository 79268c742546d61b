// SPDX-License-Identifier: GPL-3.0-or-later
// The sparse Cholesky factor of a symmetric matrix, entries of its inverse, and the assembly of its
// lower triangle.
#pragma once

#include <Eigen/SparseCore>
#include <algorithm>
#include <cstddef>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::fitting {

using SparseMatrix = Eigen::SparseMatrix<double>;

// The meaning of a matrix's rows.
enum class RowKind {
  kUnknown,
  kCoordinate,  // row 3 v + c is coordinate c of vertex v; blocks of two vertices are full or empty
};

// The factor of lower + shift * identity, by CHOLMOD in one thread. `lower` is the lower triangle
// of a positive semidefinite matrix.
class SparseFactor {
 public:
  SparseFactor(const SparseMatrix& lower, double shift, RowKind rows = RowKind::kUnknown);
  ~SparseFactor();
  bool usable() const;  // false: not positive definite
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& right) const;
  Eigen::VectorXd Pivots() const;  // squares of the factor's diagonal, in the factor's order
  double LogDeterminant() const;

 private:
  struct Cholmod;
  std::unique_ptr<Cholmod> cholmod_;
};

// Estimates the rank of a matrix with the given number of rows from its normal matrix `lower`. With
// columns scaled to length 1, it counts the directions whose eigenvalues exceed about 1e-10.
// Returns -1 if there is no usable factor, for example because a number is not finite.
int NumericalRank(const SparseMatrix& lower, std::size_t rows);

// Makes OpenBLAS and OpenMP use one thread for the following calls of this thread. OpenBLAS, if the
// sparse Cholesky uses it, sums in an order that depends on its number of threads, and so on the
// machine; one thread gives the same bytes everywhere, and small blocks gain nothing from more.
// CHOLMOD starts four OpenMP threads whatever the setting, and OpenMP ends the program if the
// system refuses a thread. Both functions are looked up at run time, because other libraries lack
// them. Throws Error if OpenBLAS is built without threads: it takes no locks, and concurrent calls
// get each other's buffers.
void UseOneLibraryThread();

// Sums a lower triangle entry by entry. Entries wait as triplets, at most 16 MB of them, and are
// then added to the sum.
class TriangleSum {
 public:
  explicit TriangleSum(Eigen::Index rows) : sum_(rows, rows) {}

  // Requires row >= column.
  void Add(int row, int column, double value) {
    waiting_.emplace_back(row, column, value);
    if (waiting_.size() == kMaxWaiting) {
      Flush();
    }
  }

  SparseMatrix Take() {
    Flush();
    return std::move(sum_);
  }

 private:
  static constexpr std::size_t kMaxWaiting = 1 << 20;

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

// Sums a lower triangle over coordinates of vertices, block by block; coordinate c of vertex v is
// row 3 v + c. A look-up per block replaces the sorting of nine entries.
class BlockTriangleSum {
 public:
  explicit BlockTriangleSum(std::size_t vertices) : columns_(vertices) {}

  // Requires vertices row >= column. Only the lower triangle of a diagonal block is used.
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

}  // namespace semblance::fitting
