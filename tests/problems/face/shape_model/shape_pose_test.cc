// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/shape_pose.h"

#include <ceres/manifold.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <numbers>

#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

PoseStep AnyStep(Random& random, double size) {
  return PoseStep::NullaryExpr([&] { return random.Uniform(-size, size); });
}

ShapePose AnyPose(Random& random) { return MovePose(kUprightPose, AnyStep(random, 3)); }

double LargestDifference(const ShapePose& a, const ShapePose& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    most = std::max(most, std::abs(a[k] - b[k]));
  }
  return most;
}

TEST(ShapePose, AStepLeadsToWhereStepBetweenFindsIt) {
  Random random(1);
  for (int k = 0; k < 100; ++k) {
    const ShapePose from = AnyPose(random);
    const PoseStep step = AnyStep(random, 1.7);  // turns of less than pi
    EXPECT_LT((StepBetween(from, MovePose(from, step)) - step).norm(), 1e-12);
    EXPECT_LT(LargestDifference(MovePose(from, PoseStep::Zero()), from), 1e-15);
  }
}

// The oracle multiplies matrices: a step turns about the pose's own t.
TEST(ShapePose, ATurnMultipliesTheRotationFromTheLeft) {
  Random random(2);
  for (int k = 0; k < 20; ++k) {
    const ShapePose from = AnyPose(random);
    const PoseStep step = AnyStep(random, 2);
    const Vec3 omega = step.segment<3>(1);
    const Mat3 expected =
        Eigen::AngleAxisd(omega.norm(), omega.normalized()).toRotationMatrix() * PoseRotation(from);
    EXPECT_LT((PoseRotation(MovePose(from, step)) - expected).norm(), 1e-12);
  }
}

TEST(ShapePose, HoldsASimilarity) {
  const Mat3 rotation = Eigen::AngleAxisd(2.5, Vec3(1, 2, -2) / 3).toRotationMatrix();
  const ShapePose pose = MakePose(1.7, rotation, {1, 2, 3});
  EXPECT_NEAR(std::exp(pose[0]), 1.7, 1e-12);
  EXPECT_LT((PoseRotation(pose) - rotation).norm(), 1e-12);
  EXPECT_EQ(Vec3(pose[5], pose[6], pose[7]), Vec3(1, 2, 3));
}

TEST(ShapePose, TheWayBackIsTheShorterTurn) {
  const ShapePose from = kUprightPose;
  ShapePose to = MovePose(from, (PoseStep() << 0, 0, 0, 3, 0, 0, 0).finished());
  for (int k = 1; k < 5; ++k) {
    to[k] = -to[k];  // the other quaternion of the same rotation
  }
  EXPECT_NEAR(StepBetween(from, to)[3], 3, 1e-12);
  EXPECT_LT(StepBetween(from, from).norm(), 1e-15);
}

// Ceres' own quaternions take half of the turn as their step.
TEST(ShapePose, TheManifoldAgreesWithThatOfCeres) {
  Random random(4);
  const std::unique_ptr<ceres::Manifold> ours(MakePoseManifold());
  const ceres::QuaternionManifold theirs;
  for (int k = 0; k < 20; ++k) {
    const ShapePose from = AnyPose(random);
    const PoseStep step = AnyStep(random, 1);
    const Vec3 half = step.segment<3>(1) / 2;
    ShapePose to;
    ASSERT_TRUE(ours->Plus(from.data(), step.data(), to.data()));
    std::array<double, 4> quaternion;
    ASSERT_TRUE(theirs.Plus(from.data() + 1, half.data(), quaternion.data()));
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(to[1 + i], quaternion[i], 1e-12);
    }
  }
}

TEST(ShapePose, TheManifoldsJacobiansAreThoseOfItsSteps) {
  Random random(5);
  const std::unique_ptr<ceres::Manifold> manifold(MakePoseManifold());
  const ShapePose at = AnyPose(random);
  Eigen::Matrix<double, 8, 7, Eigen::RowMajor> plus;
  Eigen::Matrix<double, 7, 8, Eigen::RowMajor> minus;
  ASSERT_TRUE(manifold->PlusJacobian(at.data(), plus.data()));
  ASSERT_TRUE(manifold->MinusJacobian(at.data(), minus.data()));
  EXPECT_TRUE((minus * plus).isIdentity(1e-12));
  for (int k = 0; k < 7; ++k) {
    const PoseStep step = 1e-6 * PoseStep::Unit(k);
    const ShapePose above = MovePose(at, step), below = MovePose(at, -step);
    for (int i = 0; i < 8; ++i) {
      EXPECT_NEAR(plus(i, k), (above[i] - below[i]) / 2e-6, 1e-8);
    }
  }
}

}  // namespace
}  // namespace semblance::problems
