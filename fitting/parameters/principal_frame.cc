// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/principal_frame.h"

#include <Eigen/Dense>

namespace semblance {
Vec3 MeanPoint(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) {
    sum += p;
  }
  return sum / static_cast<double>(points.size());
}

PrincipalFrame PrincipalFrameOf(std::span<const Vec3> points) {
  PrincipalFrame p{.mean = MeanPoint(points), .axes = {}, .spreads = {}};
  Mat3 moments = Mat3::Zero();
  for (const Vec3& x : points) {
    moments += (x - p.mean) * (x - p.mean).transpose() / static_cast<double>(points.size());
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(moments);
  p.axes = eigen.eigenvectors();
  p.spreads = eigen.eigenvalues();
  for (int k = 0; k < 3; ++k) {
    Eigen::Index at = 0;
    p.axes.col(k).cwiseAbs().maxCoeff(&at);
    p.axes.col(k) *= p.axes(at, k) < 0 ? -1 : 1;
  }
  return p;
}

}  // namespace semblance
