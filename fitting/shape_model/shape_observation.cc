// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/shape_model/shape_observation.h"

#include <Eigen/Cholesky>

namespace semblance {

Eigen::Matrix3d WhiteningOf(const PointSpread& s) {
  const auto square = [](double x) { return x * x; };
  const Mat3 along_normal = s.normal * s.normal.transpose();
  const Mat3 covariance = square(s.normal_sd_mm) * along_normal +
                          square(s.tangent_sd_mm) * (Mat3::Identity() - along_normal) +
                          square(s.along_sd_mm) * s.direction * s.direction.transpose();
  return covariance.llt().matrixL().solve(Mat3::Identity());
}

double LossWeight(const ShapeObservation& seen, const Vec3& placed) {
  const double residual = (seen.whitening * (placed - seen.position)).norm();
  return residual <= seen.loss_width ? 1 : seen.loss_width / residual;
}

}  // namespace semblance
