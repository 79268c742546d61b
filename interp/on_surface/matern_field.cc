// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/matern_field.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "surfaces/base/parallel.h"

namespace semblance::interp {
namespace {

constexpr Eigen::Index kSolvedTogether = 16;  // right sides per solve: 8 bytes per vertex each
constexpr double kStep = 2e-3;  // of log(kappa^2); balances truncation (step^2) and round-off (1 /
                                // step^2)

constexpr double kMinEigenvalueShare = 1e-11;  // of the largest eigenvalue; smaller ones are
                                               // round-off

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

MaternDomain WithLengths(MaternDomain domain, const Eigen::VectorXd& share) {
  domain.laplacian.area_mm2.array() /= share.array().square();
  return domain;
}

double MaternKappa(int alpha, double length_mm) {
  return alpha == 1 ? 1 / length_mm : std::sqrt(2.0 * (alpha - 1)) / length_mm;
}

Eigen::SparseMatrix<double> ShiftedStiffness(const MeshLaplacian& laplacian, double shift) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < laplacian.area_mm2.size(); ++i) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(i), shift * laplacian.area_mm2[i]);
  }
  Eigen::SparseMatrix<double> diagonal(laplacian.stiffness.rows(), laplacian.stiffness.cols());
  diagonal.setFromTriplets(entries.begin(), entries.end());
  return laplacian.stiffness + diagonal;
}

MaternField::MaternField(const MaternDomain& domain, int alpha, double kappa)
    : domain_(domain),
      alpha_(alpha),
      shift_(kappa * kappa),
      solver_(domain.points, ShiftedStiffness(domain.laplacian, shift_)) {}

Eigen::MatrixXd MaternField::Covariances(const Eigen::MatrixXd& weights,
                                         const RunContext& run) const {
  Eigen::MatrixXd covariances(weights.rows(), weights.cols());
  const Eigen::Index blocks = (weights.cols() + kSolvedTogether - 1) / kSolvedTogether;
  ParallelFor(static_cast<std::size_t>(blocks), run.threads, 1, [&](std::size_t block) {
    run.ThrowIfStopped();
    const Eigen::Index first = static_cast<Eigen::Index>(block) * kSolvedTogether;
    const Eigen::Index count = std::min(kSolvedTogether, weights.cols() - first);
    Eigen::MatrixXd x = solver_.Solve(weights.middleCols(first, count));
    for (int k = 1; k < alpha_; ++k) {
      x = solver_.Solve(domain_.laplacian.area_mm2.asDiagonal() * x);
    }
    covariances.middleCols(first, count) = x;
  });
  return covariances;
}

// Let t = log s with s = kappa^2, and Z(t) = K^-1. Then K^-1 C K^-1 = -Z' / s, and K^-1 C K^-1 C
// K^-1 = (Z'' - Z') / (2 s^2).
Eigen::SparseMatrix<double> MaternField::LocalCovariances() const {
  const Eigen::SparseMatrix<double> pattern = ShiftedStiffness(domain_.laplacian, shift_);
  const auto at = [&](double log_step) {
    const double shift = shift_ * std::exp(log_step);
    return MeshSolver(domain_.points, ShiftedStiffness(domain_.laplacian, shift))
        .SelectedInverse(pattern);
  };
  if (alpha_ == 1) {
    return solver_.SelectedInverse(pattern);
  }
  const Eigen::SparseMatrix<double> less = at(-kStep), more = at(kStep);
  const Eigen::SparseMatrix<double> slope = (more - less) / (2 * kStep);
  if (alpha_ == 2) {
    return -slope / shift_;
  }
  const Eigen::SparseMatrix<double> middle = solver_.SelectedInverse(pattern);
  const Eigen::SparseMatrix<double> bend = (more - 2 * middle + less) / (kStep * kStep);
  return (bend - slope) / (2 * shift_ * shift_);
}

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
  const Eigen::Index left = (shares.array() > kMinEigenvalueShare * shares[size - 1]).count();
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

}  // namespace semblance::interp
