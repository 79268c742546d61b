// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <vector>

#include "fitting/least_squares/sparse_factor.h"
#include "surfaces/base/random.h"

namespace semblance::fitting {
namespace {

// Rows of four consecutive entries each, like those of points on a curve.
Eigen::MatrixXd Rows(int rows, int columns, std::uint64_t random_seed) {
  Random random(random_seed);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(rows, columns);
  for (int k = 0; k < rows; ++k) {
    const int first = std::min(static_cast<int>(random.Uniform(0, columns - 3)), columns - 4);
    for (int i = 0; i < 4; ++i) {
      a(k, first + i) = random.Uniform(0.1, 1);
    }
  }
  return a;
}

SparseMatrix LowerTriangle(const Eigen::MatrixXd& a) {
  const Eigen::MatrixXd normal = a.transpose() * a;
  return Eigen::MatrixXd(normal.triangularView<Eigen::Lower>()).sparseView();
}

// Few rows, many rows, repeated rows and columns without rows, with columns of different sizes.
TEST(NumericalRank, EqualsThatOfTheSingularValues) {
  for (std::uint64_t k = 0; k < 60; ++k) {
    const int columns = 10 + static_cast<int>(k), rows = 3 + 2 * static_cast<int>(k % 37);
    Eigen::MatrixXd a = Rows(rows, columns, k);
    a.bottomRows(rows / 3) = 2 * a.topRows(rows / 3);
    a.col(columns / 2).setZero();
    a.array().colwise() *= Eigen::ArrayXd::LinSpaced(rows, -3, 3).exp();
    const int expected =
        static_cast<int>(Eigen::JacobiSVD<Eigen::MatrixXd>(
                             a * a.colwise().norm().cwiseMax(1e-300).cwiseInverse().asDiagonal())
                             .setThreshold(1e-5)
                             .rank());
    EXPECT_EQ(NumericalRank(LowerTriangle(a), rows), expected) << k;
  }
}

// The Laplacian of a square grid with a small shift. Its factor has wide dense blocks.
SparseMatrix GridLaplacian(int side) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int k = 0; k < side * side; ++k) {
    entries.emplace_back(k, k, 4.1);
    if (k % side > 0) {
      entries.emplace_back(k, k - 1, -1);
    }
    if (k >= side) {
      entries.emplace_back(k, k - side, -1);
    }
  }
  SparseMatrix lower(side * side, side * side);
  lower.setFromTriplets(entries.begin(), entries.end());
  return lower;
}

std::ptrdiff_t ThreadsOfThisProcess() {
  return std::ranges::distance(std::filesystem::directory_iterator("/proc/self/task"));
}

TEST(SparseFactor, NoLibraryStartsThreads) {
  const SparseMatrix lower = GridLaplacian(60);
  const std::ptrdiff_t before = ThreadsOfThisProcess();
  const SparseFactor factor(lower, 0);
  ASSERT_TRUE(factor.usable());
  EXPECT_EQ(ThreadsOfThisProcess(), before);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(lower.rows());
  const Eigen::VectorXd solved = factor.Solve(ones);
  EXPECT_LT((lower.selfadjointView<Eigen::Lower>() * solved - ones).norm(), 1e-10);
}

// Blocks that couple x, y and z of each vertex of a ring and of its neighbours.
SparseMatrix RingOfVertices(int vertices) {
  Random random(5);
  BlockTriangleSum sum(vertices);
  for (int v = 0; v < vertices; ++v) {
    const int next = (v + 1) % vertices;
    const Eigen::MatrixXd a = Eigen::MatrixXd::NullaryExpr(8, 6, [&] { return random.Normal(); });
    const Eigen::MatrixXd normal = a.transpose() * a;
    sum.Add(v, v, normal.topLeftCorner<3, 3>());
    sum.Add(next, next, normal.bottomRightCorner<3, 3>());
    sum.Add(std::max(v, next), std::min(v, next),
            v < next ? normal.bottomLeftCorner<3, 3>() : normal.topRightCorner<3, 3>());
  }
  return sum.Take();
}

TEST(BlockTriangleSum, IsTheSumOfItsBlocks) {
  Random random(3);
  const auto number = [&] { return random.Normal(); };
  const Mat3 a = Mat3::NullaryExpr(number), b = Mat3::NullaryExpr(number),
             c = Mat3::NullaryExpr(number);
  BlockTriangleSum sum(3);
  sum.Add(2, 0, a);
  sum.Add(1, 0, b);
  sum.Add(2, 0, c);
  sum.Add(1, 1, c);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(9, 9);
  expected.block<3, 3>(6, 0) = a + c;
  expected.block<3, 3>(3, 0) = b;
  expected.block<3, 3>(3, 3).triangularView<Eigen::Lower>() = c;
  const SparseMatrix taken = sum.Take();
  EXPECT_EQ(Eigen::MatrixXd(taken), expected);
  EXPECT_EQ(taken.nonZeros(), 9 + 9 + 6);
}

TEST(SparseFactor, OrderByVertexGivesTheSameSolution) {
  const SparseMatrix lower = RingOfVertices(40);
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(lower.rows(), -1, 2);
  const SparseFactor plain(lower, 1e-3), by_vertex(lower, 1e-3, RowKind::kCoordinate);
  ASSERT_TRUE(plain.usable() && by_vertex.usable());
  const Eigen::VectorXd solved = plain.Solve(right);
  EXPECT_LT((by_vertex.Solve(right) - solved).norm(), 1e-10 * solved.norm());
  EXPECT_NEAR(by_vertex.LogDeterminant(), plain.LogDeterminant(), 1e-9);
}

TEST(NumericalRank, OfNothingIsZero) { EXPECT_EQ(NumericalRank(SparseMatrix(7, 7), 5), 0); }

// The Laplacian of a grid with some additional random pairs.
Eigen::SparseMatrix<double> RandomLaplacian(int side, std::uint64_t seed) {
  Random random(seed);
  const int count = side * side;
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(count, count);
  const auto couple = [&](int a, int b, double weight) {
    all(a, a) += weight;
    all(b, b) += weight;
    all(a, b) -= weight;
    all(b, a) -= weight;
  };
  for (int k = 0; k < count; ++k) {
    all(k, k) += 0.01;
    if (k % side + 1 < side) {
      couple(k, k + 1, random.Uniform(0.5, 2));
    }
    if (k + side < count) {
      couple(k, k + side, random.Uniform(0.5, 2));
    }
    if (const auto other = static_cast<int>(random.Index(count)); k % 5 == 0 && other != k) {
      couple(k, other, 1);
    }
  }
  return Eigen::MatrixXd(all.triangularView<Eigen::Lower>()).sparseView();
}

TEST(SelectedInverse, IsTheInverseWhereTheMatrixHasEntries) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Eigen::SparseMatrix<double> lower = RandomLaplacian(7, seed);
    const Eigen::MatrixXd whole =
        (Eigen::MatrixXd(lower) +
         Eigen::MatrixXd(Eigen::MatrixXd(lower).triangularView<Eigen::StrictlyLower>()).transpose())
            .inverse();
    const SelectedInverse inverse(lower);
    ASSERT_TRUE(inverse.usable());
    for (int k = 0; k < lower.outerSize(); ++k) {
      for (Eigen::SparseMatrix<double>::InnerIterator entry(lower, k); entry; ++entry) {
        const auto row = static_cast<int>(entry.row());
        EXPECT_NEAR(inverse.At(row, k), whole(row, k), 1e-10 * whole(k, k));
        EXPECT_EQ(inverse.At(k, row), inverse.At(row, k));
      }
    }
  }
}

TEST(SelectedInverse, OtherEntriesAreRefused) {
  Eigen::SparseMatrix<double> lower(2, 2);
  lower.insert(0, 0) = 1;
  lower.insert(1, 1) = -1;
  EXPECT_FALSE(SelectedInverse(lower).usable());
  lower.coeffRef(1, 1) = 1;
  const SelectedInverse inverse(lower);
  EXPECT_EQ(inverse.At(1, 1), 1);
  EXPECT_THROW(inverse.At(1, 0), std::logic_error);
}

// Concurrent fits must not share the buffers of the BLAS: a dense matrix has large supernodes.
TEST(SparseFactor, ConcurrentSolvesGiveTheBytesOfASingleOne) {
  const int columns = 64;
  Random random(7);
  Eigen::MatrixXd a(columns + 50, columns);
  a = a.unaryExpr([&](double) { return random.Uniform(-1, 1); });
  const SparseMatrix lower = LowerTriangle(a);
  const Eigen::MatrixXd right = Eigen::MatrixXd::Ones(columns, 3);
  const Eigen::MatrixXd alone = SparseFactor(lower, 0).Solve(right);
  std::atomic<int> differences = 0;
  {
    std::vector<std::jthread> threads;
    for (int k = 0; k < 8; ++k) {
      threads.emplace_back([&] {
        for (int n = 0; n < 2000; ++n) {
          differences += SparseFactor(lower, 0).Solve(right) != alone ? 1 : 0;
        }
      });
    }
  }
  EXPECT_EQ(differences, 0);
}

}  // namespace
}  // namespace semblance::fitting
