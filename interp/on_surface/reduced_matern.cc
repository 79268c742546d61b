// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/reduced_matern.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

namespace semblance {
namespace {

constexpr double kLeastShare = 1e-11;  // of the largest eigenvalue: less is rounding

// H(s) and -H'(s).
struct Resolvent {
  Eigen::MatrixXd value, minus_slope;
};

Resolvent ResolventAt(double shift, const MaternDomain& domain, const Eigen::MatrixXd& weights,
                      const RunContext& run) {
  const Eigen::MatrixXd x = MaternField(domain, 1, std::sqrt(shift)).Covariances(weights, run);
  return {weights.transpose() * x, x.transpose() * domain.laplacian.area_mm2.asDiagonal() * x};
}

Eigen::MatrixXd Symmetric(const Eigen::MatrixXd& matrix) {
  return (matrix + matrix.transpose()) / 2;
}

}  // namespace

ReducedMatern::ReducedMatern(const MaternDomain& domain, const Eigen::MatrixXd& weights,
                             std::span<const double> poles, const RunContext& run) {
  const Eigen::Index n = weights.cols(), size = n * std::ssize(poles);
  std::vector<Resolvent> at;
  for (const double pole : poles) {
    at.push_back(ResolventAt(pole, domain, weights, run));
  }
  Eigen::MatrixXd area(size, size), stiffness(size, size), values(n, size);
  for (std::size_t i = 0; i < poles.size(); ++i) {
    for (std::size_t j = 0; j < poles.size(); ++j) {
      const Eigen::Index row = n * static_cast<Eigen::Index>(i),
                         column = n * static_cast<Eigen::Index>(j);
      const Eigen::MatrixXd gram =
          i == j ? at[i].minus_slope
                 : Eigen::MatrixXd((at[i].value - at[j].value) / (poles[j] - poles[i]));
      area.block(row, column, n, n) = gram;
      stiffness.block(row, column, n, n) = at[i].value - poles[j] * gram;
    }
    values.middleCols(n * static_cast<Eigen::Index>(i), n) = at[i].value;
  }
  const Eigen::VectorXd scale = area.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> basis(
      Symmetric(scale.asDiagonal() * area * scale.asDiagonal()));
  const Eigen::VectorXd& shares = basis.eigenvalues();
  const Eigen::Index left = (shares.array() > kLeastShare * shares[size - 1]).count();
  const Eigen::MatrixXd to_basis = scale.asDiagonal() * basis.eigenvectors().rightCols(left) *
                                   shares.tail(left).cwiseSqrt().cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(
      Symmetric(to_basis.transpose() * stiffness * to_basis));
  lambda_ = modes.eigenvalues().cwiseMax(0);
  modes_ = values * to_basis * modes.eigenvectors();
}

MaternCorrelations ReducedMatern::At(int alpha, double length_mm) const {
  const double kappa = MaternKappa(alpha, length_mm), shift = kappa * kappa;
  const Eigen::VectorXd decay = (shift + lambda_.array()).inverse();
  const Eigen::VectorXd power = decay.array().pow(alpha);
  const Eigen::MatrixXd s = modes_ * power.asDiagonal() * modes_.transpose();
  const Eigen::MatrixXd by_log =
      2 * alpha * shift * (modes_ * power.cwiseProduct(decay).asDiagonal() * modes_.transpose());
  const Eigen::VectorXd root = s.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd relative = by_log.diagonal().cwiseQuotient(s.diagonal()) / 2;
  MaternCorrelations correlations{root.asDiagonal() * s * root.asDiagonal(),
                                  root.asDiagonal() * by_log * root.asDiagonal()};
  for (Eigen::Index j = 0; j < s.cols(); ++j) {
    for (Eigen::Index i = 0; i < s.rows(); ++i) {
      correlations.by_log_length(i, j) -= correlations.value(i, j) * (relative[i] + relative[j]);
    }
  }
  return correlations;
}

}  // namespace semblance
