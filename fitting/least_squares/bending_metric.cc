// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/bending_metric.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace semblance {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen2 = Eigen::SelfAdjointEigenSolver<Matrix2d>;

constexpr double kPerDegree = std::numbers::pi / 180;

Matrix2d Symmetric(double ss, double st, double tt) {
  return (Matrix2d() << ss, st, st, tt).finished();
}

Matrix2d With(const Eigen2& eigen, const Vector2d& values) {
  return eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
}

BendingMetric StretchedAtMost(const BendingMetric& metric, double most_stretch) {
  const Eigen2 eigen(metric);
  const double stretch = std::min(eigen.eigenvalues()[1], most_stretch);
  return With(eigen, {1 / stretch, stretch});
}

BendingMetric OfDeterminant1(const Matrix2d& m) { return m / std::sqrt(m.determinant()); }

// The integral of H M H.
Matrix2d BendingThrough(const BendingMetric& m, const BendingSums& sums) {
  const auto& [ss_ss, st_st, tt_tt, ss_st, st_tt, ss_tt] = sums;
  return Symmetric(m(0, 0) * ss_ss + 2 * m(0, 1) * ss_st + m(1, 1) * st_st,
                   m(0, 0) * ss_st + m(0, 1) * (ss_tt + st_st) + m(1, 1) * st_tt,
                   m(0, 0) * st_st + 2 * m(0, 1) * st_tt + m(1, 1) * tt_tt);
}

}  // namespace

BendingMetric MetricOf(const BendingStretch& s) {
  if (s.stretch == 1) {
    return BendingMetric::Identity();
  }
  const double turn = s.direction_deg * kPerDegree;
  const Vector2d along(std::cos(turn), std::sin(turn)), across(-along.y(), along.x());
  return s.stretch * along * along.transpose() + across * across.transpose() / s.stretch;
}

BendingStretch StretchOf(const BendingMetric& metric) {
  const Eigen2 eigen(metric);
  const double stretch = eigen.eigenvalues()[1];
  if (!(stretch > 1)) {
    return {};
  }
  const Vector2d along = eigen.eigenvectors().col(1);
  const double direction_deg = std::atan2(along.y(), along.x()) / kPerDegree;
  return {.stretch = stretch, .direction_deg = std::fmod(direction_deg + 360, 180)};
}

BendingSums BendingFactors(const BendingMetric& metric) {
  const double ss = metric(0, 0), st = metric(0, 1), tt = metric(1, 1);
  return {ss * ss, 2 * (ss * tt + st * st), tt * tt, 4 * ss * st, 4 * st * tt, 2 * st * st};
}

double BendingIn(const BendingMetric& metric, const BendingSums& sums) {
  const BendingSums factors = BendingFactors(metric);
  return std::inner_product(factors.begin(), factors.end(), sums.begin(), 0.0);
}

// The gradient of bending over metrics of determinant 1 vanishes where M^-1 is as the integral of
// H M H. That map alone swings about its fixed point; the geometric mean with where it came from,
// which of two such matrices is their sum over the root of its determinant, does not.
BendingMetric MetricOfLeastBending(const BendingSums& sums, double most_stretch) {
  constexpr int kSteps = 30;
  BendingMetric metric = BendingMetric::Identity();
  for (int k = 0; k < kSteps; ++k) {
    const Matrix2d through = BendingThrough(metric, sums);
    if (!(through.determinant() > 0)) {
      break;  // it bends along one direction alone, or not at all
    }
    metric = OfDeterminant1(metric + OfDeterminant1(through.inverse()));
  }
  return StretchedAtMost(metric, most_stretch);
}

BendingMetric MetricBeyond(const BendingMetric& from, const BendingMetric& to,
                           double most_stretch) {
  return StretchedAtMost(to * from.inverse() * to, most_stretch);
}

double StretchBetween(const BendingMetric& one, const BendingMetric& other) {
  const double half = (one.inverse() * other).trace() / 2;
  return half + std::sqrt(std::max(half * half - 1, 0.0));
}

}  // namespace semblance
