// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/depth_truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "tests/testing/dowel_scenes.h"
#include "tests/testing/shapes.h"

namespace semblance::interp {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using testing::OnThreads;
using testing::Plate;
using testing::SphereMesh;

// The plate raised, tilted about the x axis, and made large enough to be met everywhere.
TriMesh TiltedPlate(double size, double height, double angle) {
  TriMesh plate = Plate(size, 4);
  const Mat3 rotation = Eigen::AngleAxisd(angle, Vec3(1, 0, 0)).toRotationMatrix();
  for (Vec3& p : plate.points) {
    p = rotation * (p - Vec3(size / 2, size / 2, 0)) + Vec3(0, 0, height);
  }
  return plate;
}

DepthTruth Measure(const std::vector<Vec3>& points, const Vec3& direction, const TriMesh& skin,
                   const DepthTruthOptions& options = {}) {
  return MeasureDepthTruth({points, {}}, std::vector<Vec3>(points.size(), direction), skin, options,
                           OnThreads(1));
}

TEST(DepthTruth, OfConcentricSpheresIsTheirGapByBothConventions) {
  const TriMesh skull = SphereMesh({1, 2, 3}, 80, 30);
  // Rotated, so that no ray meets a corner.
  const Mat3 rotation = Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const TriMesh skin = Transformed(SphereMesh({0, 0, 0}, 90, 30),
                                   {.rotation = rotation, .translation = Vec3(1, 2, 3)});
  std::vector<Vec3> directions;
  for (const Vec3& p : skull.points) {
    directions.push_back((p - Vec3(1, 2, 3)).normalized());
  }
  const DepthTruth truth = MeasureDepthTruth(skull, directions, skin, {}, OnThreads(2));
  EXPECT_THAT(truth.along_direction.status, Each(TruthStatus::kValid));
  EXPECT_THAT(truth.closest.status, Each(TruthStatus::kValid));
  for (std::size_t v = 0; v < skull.points.size(); ++v) {
    ASSERT_NEAR(truth.along_direction.depth_mm[v], 10, 0.3);  // the triangles are chords
    ASSERT_LE(truth.along_direction.depth_mm[v], 10 + 1e-9);
    ASSERT_LE(truth.closest.depth_mm[v], truth.along_direction.depth_mm[v] + 1e-9);
    ASSERT_NEAR(truth.closest.depth_mm[v], truth.along_direction.depth_mm[v], 0.1);
  }
}

TEST(DepthTruth, UnderTiltedSkinTheTwoDifferByTheCosine) {
  for (const double angle : {0.2, 0.7, 1.1}) {
    const DepthTruth truth = Measure({{0, 0, 0}}, {0, 0, 1}, TiltedPlate(200, 8, angle));
    EXPECT_NEAR(truth.along_direction.depth_mm[0], 8, 1e-9);
    EXPECT_NEAR(truth.closest.depth_mm[0], 8 * std::cos(angle), 1e-9);
  }
}

TEST(DepthTruth, ReportsWhyADepthIsMissing) {
  const auto statuses = [](const DepthTruth& truth) {
    return std::pair(truth.along_direction.status[0], truth.closest.status[0]);
  };
  const TriMesh plate = TiltedPlate(200, 8, 0);
  using enum TruthStatus;
  EXPECT_EQ(statuses(Measure({{0, 0, 0}}, Vec3::Zero(), plate)),
            std::pair(kNoDirection, kNoDirection));
  EXPECT_EQ(statuses(Measure({{0, 0, -60}}, {0, 0, 1}, plate)), std::pair(kNoHit, kTooFar));
  EXPECT_EQ(statuses(Measure({{0, 0, 10}}, {0, 0, 1}, plate)), std::pair(kNoHit, kBehind));
  EXPECT_EQ(statuses(Measure({{0, 0, 0}}, {0, 0, 1}, TiltedPlate(200, 8, 1.4))),
            std::pair(kGrazing, kGrazing));
  // A ray that enters skin starts in the air: the skin is an inner wall or belongs to another part.
  EXPECT_EQ(statuses(Measure({{0, 0, 0}}, {0, 0, 1}, TiltedPlate(200, 8, std::numbers::pi))),
            std::pair(kNoHit, kGrazing));
  const DepthTruth none = Measure({{0, 0, -60}}, {0, 0, 1}, plate);
  EXPECT_TRUE(std::isnan(none.along_direction.depth_mm[0]));
  EXPECT_TRUE(std::isnan(none.closest.depth_mm[0]));
}

TEST(DepthTruth, NeedsOneDirectionPerVertex) {
  EXPECT_THROW(MeasureDepthTruth({{{0, 0, 0}}, {}}, {}, Plate(10, 1), {}, OnThreads(1)),
               InputError);
}

}  // namespace
}  // namespace semblance::interp
