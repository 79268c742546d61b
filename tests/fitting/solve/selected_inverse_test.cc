// SPDX-License-Identifier: GPL-3.0-or-later
// Compares selected entries with the whole inverse.
#include "fitting/solve/selected_inverse.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <stdexcept>

#include "surfaces/base/random.h"

namespace semblance {
namespace {

// The Laplacian of a grid with some additional random pairs.
Eigen::SparseMatrix<double> LowerOf(int side, std::uint64_t seed) {
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
    const Eigen::SparseMatrix<double> lower = LowerOf(7, seed);
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

}  // namespace
}  // namespace semblance
