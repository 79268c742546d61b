// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/shape_pose.h"

#include <ceres/manifold.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace semblance::problems {
namespace {

Eigen::Quaterniond PoseQuaternion(std::span<const double> pose) {
  return {pose[1], pose[2], pose[3], pose[4]};
}

Eigen::Quaterniond MakeTurn(const Vec3& omega) {
  const double angle = omega.norm();
  return angle == 0 ? Eigen::Quaterniond::Identity()
                    : Eigen::Quaterniond(Eigen::AngleAxisd(angle, omega / angle));
}

Vec3 FindTurn(Eigen::Quaterniond q) {
  if (q.w() < 0) {
    q.coeffs() *= -1;  // the same rotation, the shorter way
  }
  const double sine = q.vec().norm();
  return sine == 0 ? Vec3(Vec3::Zero()) : Vec3(2 * std::atan2(sine, q.w()) / sine * q.vec());
}

// d(exp(omega) q) / d omega at omega = 0: half the product of a vector and q. Its columns are
// orthogonal, and half as long as q.
Eigen::Matrix<double, 4, 3> QuaternionByTurn(const Eigen::Quaterniond& q) {
  Eigen::Matrix<double, 4, 3> by;
  by.row(0) = -q.vec().transpose();
  by.bottomRows<3>() = q.w() * Mat3::Identity() - CrossMatrix(q.vec());
  return by / 2;
}

class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 8; }
  int TangentSize() const override { return 7; }

  bool Plus(const double* x, const double* delta, double* sum) const override {
    std::ranges::copy(MovePose(AsPose(x), PoseStep::Map(delta)), sum);
    return true;
  }
  bool Minus(const double* y, const double* x, double* difference) const override {
    PoseStep::Map(difference) = StepBetween(AsPose(x), AsPose(y));
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 8, 7, Eigen::RowMajor>> by(jacobian);
    by.setZero();
    by(0, 0) = 1;
    by.block<4, 3>(1, 1) = QuaternionByTurn(PoseQuaternion({x, 8}));
    by.bottomRightCorner<3, 3>().setIdentity();
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 8, Eigen::RowMajor>>{jacobian} = PoseStepDerivative({x, 8});
    return true;
  }

 private:
  static ShapePose AsPose(const double* x) {
    ShapePose pose;
    std::copy_n(x, pose.size(), pose.begin());
    return pose;
  }
};

}  // namespace

ShapePose MakePose(double scale, const Mat3& rotation, const Vec3& translation) {
  const Eigen::Quaterniond q(rotation);
  return {std::log(scale), q.w(),           q.x(),           q.y(),
          q.z(),           translation.x(), translation.y(), translation.z()};
}

Mat3 PoseRotation(std::span<const double> pose) {
  return PoseQuaternion(pose).normalized().toRotationMatrix();
}

ShapePose MovePose(const ShapePose& from, const PoseStep& step) {
  const Eigen::Quaterniond q = (MakeTurn(step.segment<3>(1)) * PoseQuaternion(from)).normalized();
  return {from[0] + step[0], q.w(), q.x(), q.y(), q.z(), from[5] + step[4], from[6] + step[5],
          from[7] + step[6]};
}

PoseStep StepBetween(const ShapePose& from, const ShapePose& to) {
  PoseStep step;
  step[0] = to[0] - from[0];
  step.segment<3>(1) = FindTurn(PoseQuaternion(to) * PoseQuaternion(from).conjugate());
  for (int k = 0; k < 3; ++k) {
    step[4 + k] = to[5 + k] - from[5 + k];
  }
  return step;
}

ceres::Manifold* MakePoseManifold() { return new PoseManifold; }

Eigen::Matrix<double, 7, 8> PoseStepDerivative(std::span<const double> pose) {
  Eigen::Matrix<double, 7, 8> by = Eigen::Matrix<double, 7, 8>::Zero();
  by(0, 0) = 1;
  by.block<3, 4>(1, 1) = 4 * QuaternionByTurn(PoseQuaternion(pose)).transpose();
  by.bottomRightCorner<3, 3>().setIdentity();
  return by;
}

}  // namespace semblance::problems
