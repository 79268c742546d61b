// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/correspondences.h"

#include <gtest/gtest.h>

#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::SphereMesh;

constexpr double kRadius_mm = 10;

TEST(Correspondences, ClosestPointAndItsNormalOfASphere) {
  const Correspondences sphere(SphereMesh({0, 0, 0}, kRadius_mm, 40));
  const Vec3 out = Vec3(1, 2, 3).normalized();
  const auto found = sphere.Find(12 * out, out, {.reach_mm = 3, .least_cosine = 0.9});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->point.distance_mm, 2, 0.1);
  EXPECT_NEAR(found->normal.dot(out), 1, 0.01);
  EXPECT_NEAR(found->normal.norm(), 1, 1e-12);
}

TEST(Correspondences, NoneBeyondTheReach) {
  const Correspondences sphere(SphereMesh({0, 0, 0}, kRadius_mm, 40));
  EXPECT_FALSE(sphere.Find({0, 0, 14}, Vec3::UnitZ(), {.reach_mm = 3}));
  EXPECT_TRUE(sphere.Find({0, 0, 14}, Vec3::UnitZ(), {.reach_mm = 5}));
}

TEST(Correspondences, NoneThatFacesAnotherWayUnlessEveryDirectionIsAccepted) {
  const Correspondences sphere(SphereMesh({0, 0, 0}, kRadius_mm, 40));
  EXPECT_FALSE(sphere.Find({0, 0, 11}, -Vec3::UnitZ(), {.least_cosine = 0.3}));
  EXPECT_FALSE(sphere.Find({0, 0, 11}, Vec3::UnitX(), {.least_cosine = 0.3}));
  EXPECT_TRUE(sphere.Find({0, 0, 11}, -Vec3::UnitZ(), {}));
}

TEST(Correspondences, NoneBesideAnOpenBorderIfThatIsRejected) {
  const TriMesh square{{{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const Vec3 over(6, 3, 1);
  EXPECT_TRUE(Correspondences(square).Find(over, Vec3::UnitZ(), {}));
  EXPECT_FALSE(Correspondences(square, OpenBorder::kReject).Find(over, Vec3::UnitZ(), {}));
}

}  // namespace
}  // namespace semblance::surfaces
