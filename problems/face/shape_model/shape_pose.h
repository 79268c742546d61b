// SPDX-License-Identifier: GPL-3.0-or-later
// The pose of a shape: a similarity as a point of a manifold, so that no direction of rotation is
// special and none is singular.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "surfaces/base/geometry.h"

namespace ceres {
class Manifold;
}

namespace semblance::problems {

// ln s, the rotation as a unit quaternion (w, x, y, z), and t in mm.
using ShapePose = std::array<double, 8>;
// A change of ln s, a turn about the pose's own t as a rotation vector in rad, a change of t in mm.
using PoseStep = Eigen::Matrix<double, 7, 1>;

inline constexpr ShapePose kUprightPose = {0, 1, 0, 0, 0, 0, 0, 0};

ShapePose MakePose(double scale, const Mat3& rotation, const Vec3& translation);
Mat3 PoseRotation(std::span<const double> pose);

ShapePose MovePose(const ShapePose& from, const PoseStep& step);
// The step with MovePose(from, step) = to, up to the sign of the quaternion. The turn is at most
// pi.
PoseStep StepBetween(const ShapePose& from, const ShapePose& to);

// MovePose, StepBetween and their derivatives at a step of 0, for Ceres, which owns the result.
ceres::Manifold* MakePoseManifold();

// The derivatives of a step at 0 by the eight numbers of the pose: a cost with the derivatives D by
// a step (n x 7) has D * PoseStepDerivative(pose) by the pose.
Eigen::Matrix<double, 7, 8> PoseStepDerivative(std::span<const double> pose);

}  // namespace semblance::problems
