// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/smooth_field.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace semblance::problems {
namespace {

double KernelAt(double squared_mm, const SmoothFieldOptions& o) {
  const auto bell = [&](double sd_mm, double length_mm) {
    return sd_mm * sd_mm * std::exp(-squared_mm / (2 * length_mm * length_mm));
  };
  return bell(o.wide_sd_mm, o.wide_length_mm) + bell(o.fine_sd_mm, o.fine_length_mm);
}

double AlphaAt(const Vec3& p, std::span<const Vec3> features, const SmoothFieldOptions& o) {
  double squared_mm = std::numeric_limits<double>::infinity();
  for (const Vec3& feature : features) {
    squared_mm = std::min(squared_mm, (p - feature).squaredNorm());
  }
  const double part = std::min(1.0, std::sqrt(squared_mm) / o.feature_reach_mm);
  return o.at_features + (1 - o.at_features) * part;
}

}  // namespace

Eigen::MatrixXd SmoothFieldFactor(std::span<const Vec3> points, std::span<const int> centres,
                                  std::span<const Vec3> features,
                                  const SmoothFieldOptions& options) {
  const Eigen::Index n = std::ssize(points), m = std::ssize(centres);
  if (m == 0) {
    return Eigen::MatrixXd::Zero(n, 0);
  }
  Eigen::MatrixXd across(n, m), among(m, m);
  std::vector<double> alpha;
  for (const Vec3& p : points) {
    alpha.push_back(AlphaAt(p, features, options));
  }
  for (Eigen::Index c = 0; c < m; ++c) {
    for (Eigen::Index v = 0; v < n; ++v) {
      across(v, c) = alpha[v] * KernelAt((points[v] - points[centres[c]]).squaredNorm(), options);
    }
    for (Eigen::Index other = 0; other < m; ++other) {
      among(other, c) =
          KernelAt((points[centres[other]] - points[centres[c]]).squaredNorm(), options);
    }
  }
  among.diagonal().array() += 1e-8 * KernelAt(0, options) + 1e-12;  // centres that nearly coincide
  const Eigen::LLT<Eigen::MatrixXd> factor(among);
  return factor.matrixL().solve(across.transpose()).transpose();
}

}  // namespace semblance::problems
