// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/residual_field.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>

namespace semblance::problems {
namespace {

ControlNet FlatPlaces(int columns, int rows, double du_mm, double dv_mm) {
  ControlNet net{.columns = columns, .rows = rows, .vertices = {}};
  for (int k = 0; k < columns * rows; ++k) {
    net.vertices.emplace_back(du_mm * (k % columns), dv_mm * (k / columns), 0);
  }
  return net;
}

Eigen::MatrixXd DenseFieldRows(const std::vector<FieldRow>& rows) {
  const Eigen::Index count = std::ssize(rows);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index r = 0; r < count; ++r) {
    for (std::size_t k = 0; k < rows[r].index.size(); ++k) {
      dense(r, rows[r].index[k]) += rows[r].weight[k];
    }
  }
  return dense;
}

// The covariances of all vertices with one of them.
Eigen::VectorXd CovariancesWith(int vertex, const ControlNet& net,
                                const ResidualFieldOptions& options) {
  const Eigen::MatrixXd rows = DenseFieldRows(MakeFieldRows(net, options));
  const Eigen::MatrixXd precision = rows.transpose() * rows;
  return precision.llt().solve(Eigen::VectorXd::Unit(precision.rows(), vertex));
}

// Matern, nu = 1: (kappa d) K_1(kappa d).
double MaternCorrelation(double distance_mm, double range_mm) {
  const double x = std::sqrt(8) * distance_mm / range_mm;
  return x < 1e-9 ? 1 : x * std::cyl_bessel_k(1.0, x);
}

TEST(ResidualField, HasTheDeviationAndTheCorrelationOfAMaternFieldAtAnySpacing) {
  const ResidualFieldOptions options{.sd_mm = 1.7, .range_mm = 24};
  for (const Vec2& spacing : {Vec2(3, 3), Vec2(6, 6), Vec2(3, 6)}) {
    const int columns = 2 * static_cast<int>(60 / spacing.x()) + 1;
    const int rows = 2 * static_cast<int>(60 / spacing.y()) + 1;
    const ControlNet net = FlatPlaces(columns, rows, spacing.x(), spacing.y());
    const int middle = net.Index(columns / 2, rows / 2);
    const Eigen::VectorXd covariances = CovariancesWith(middle, net, options);
    const double variance = covariances[middle];
    // Cells of a quarter of the range average the field's peak, which lowers the deviation.
    EXPECT_NEAR(std::sqrt(variance), options.sd_mm, 0.1 * options.sd_mm) << spacing.transpose();
    for (const int steps : {1, 2, 4}) {
      const double correlation = covariances[middle + steps] / variance;
      EXPECT_NEAR(correlation, MaternCorrelation(steps * spacing.x(), options.range_mm), 0.06)
          << spacing.transpose() << ", " << steps;
    }
  }
}

// Whatever the net's lengths: a constant deviation costs its square times tau^2 kappa^4 area.
TEST(ResidualField, AConstantDeviationCostsInProportionToTheArea) {
  const ResidualFieldOptions options{.sd_mm = 0.8, .range_mm = 30};
  const double kappa = std::sqrt(8) / 30, tau = 1 / (std::sqrt(4 * M_PI) * kappa * 0.8);
  const ControlNet net = FlatPlaces(7, 5, 4, 9);
  const Eigen::MatrixXd rows = DenseFieldRows(MakeFieldRows(net, options));
  const double cost = (rows * Eigen::VectorXd::Constant(rows.cols(), 2.5)).squaredNorm();
  const double area = 6 * 4.0 * 4 * 9.0;
  EXPECT_NEAR(cost, 2.5 * 2.5 * std::pow(tau, 2) * std::pow(kappa, 4) * area, 1e-9 * cost);
}

TEST(ResidualField, ANetWithCoincidentVerticesHasFiniteRows) {
  ControlNet net = FlatPlaces(4, 4, 5, 5);
  for (int i = 0; i < 4; ++i) {
    net.At(i, 1) = net.At(i, 0);
  }
  for (const FieldRow& row : MakeFieldRows(net, {})) {
    EXPECT_GE(row.index.size(), 3u);
    for (const double weight : row.weight) {
      EXPECT_TRUE(std::isfinite(weight));
    }
  }
}

}  // namespace
}  // namespace semblance::problems
