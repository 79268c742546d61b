// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/cut_planes.h"

#include <gtest/gtest.h>

#include "surfaces/marching/polygonize.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

// A ball of 40 mm that a volume ends through at z = -20.
TriMesh CutBall() {
  SampleGrid grid{Vec3(-44, -44, -20), Vec3::Constant(2), {45, 45, 45}};
  std::vector<float> samples;
  for (std::int64_t n = 0; n < grid.CornerCount(); ++n) {
    const auto at = grid.At(n);
    samples.push_back(static_cast<float>(40 - grid.Corner(at[0], at[1], at[2]).norm()));
  }
  return PolygonizeSamples(samples, grid, {}).mesh;
}

TEST(CutPlanes, AClosedSkullHasNone) {
  EXPECT_TRUE(FindCutPlanes(testing::SphereMesh({0, 0, 0}, 40, 20)).empty());
}

TEST(CutPlanes, AScanThatEndsIsFound) {
  const auto planes = FindCutPlanes(CutBall());
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].axis, 2);
  EXPECT_EQ(planes[0].sign, -1);
  EXPECT_EQ(planes[0].at_mm, -20);
  EXPECT_EQ(ToPhrase(planes[0]), "z = -20.0 mm (lower end)");
}

TEST(CutPlanes, AHoleInTheSkullIsNoCut) {
  const TriMesh ball = testing::SphereMesh({0, 0, 0}, 40, 40);
  std::vector<bool> keep;
  for (const Triangle& t : ball.triangles) {
    keep.push_back((TriangleCentroid(ball, t) - Vec3(30, 0, 26)).norm() > 15);
  }
  EXPECT_TRUE(FindCutPlanes(Submesh(ball, keep)).empty());
}

TEST(CutPlanes, WhatALackOfBoneMakesUpIsLeftOut) {
  const TriMesh face = testing::SphereMesh({0, 0, 0}, 45, 30);
  const auto planes = FindCutPlanes(CutBall());
  const TriMesh within = WithinScan(face, planes, 5);
  EXPECT_LT(within.triangles.size(), face.triangles.size());
  for (const Triangle& t : within.triangles) {
    EXPECT_GE(TriangleCentroid(within, t).z(), -15);
  }
  EXPECT_EQ(WithinScan(face, {}, 5).triangles, face.triangles);
}

}  // namespace
}  // namespace semblance::surfaces
