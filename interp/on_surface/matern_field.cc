// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/matern_field.h"

#include <algorithm>
#include <cmath>

#include "surfaces/base/parallel.h"

namespace semblance {
namespace {

constexpr Eigen::Index kSolvedTogether = 16;  // right sides: 8 bytes per vertex each
constexpr double kStep = 2e-3;                // of kappa^2's logarithm

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

// With t the logarithm of s = kappa^2 and Z(t) = K^-1: K^-1 C K^-1 = -Z' / s, and K^-1 C K^-1 C
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

}  // namespace semblance
