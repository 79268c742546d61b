// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/fuse_meshes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "surfaces/base/error.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using ::testing::HasSubstr;
constexpr double kPi = std::numbers::pi;

TriMesh Cube(const Vec3& corner, double side) {
  TriMesh cube;
  for (int k = 0; k < 8; ++k) {
    cube.points.emplace_back(corner + side * Vec3(k & 1, (k >> 1) & 1, k >> 2));
  }
  cube.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return cube;
}

TriMesh InsideOut(TriMesh mesh) {
  for (Triangle& t : mesh.triangles) {
    std::swap(t[1], t[2]);
  }
  return mesh;
}

// The part of a mesh above a height, with an open border.
TriMesh Above(const TriMesh& mesh, double z_mm) {
  std::vector<bool> keep;
  for (const Triangle& t : mesh.triangles) {
    keep.push_back(TriangleCentroid(mesh, t).z() > z_mm);
  }
  return Submesh(mesh, keep);
}

// A plate of 100 mm at z = 0 and a sphere of 20 mm whose centre is 5 mm below it.
const TriMesh kPlate = testing::Plate(100, 30);
TriMesh Ball() { return testing::SphereMesh({50, 50, -5}, 20, 60); }

void ExpectRefused(const TriMesh& body, const TriMesh& feature, const char* words) {
  try {
    FuseMeshes(body, feature);
    FAIL() << "not refused: " << words;
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(words));
  }
}

TEST(FuseMeshes, TwoCubesHaveTheVolumeOfTheirUnion) {
  const FusedMesh fused = FuseMeshes(Cube({0, 0, 0}, 10), Cube({6, 5, 4}, 10));
  EXPECT_NEAR(SignedVolume(fused.mesh), 2000 - 4 * 5 * 6, 1e-9);
  EXPECT_NEAR(Area(fused.mesh), 2 * 600 - 2 * (4 * 5 + 4 * 6 + 5 * 6), 1e-9);
  EXPECT_NEAR(fused.seam_mm, 2 * (4 + 5 + 6), 1e-9);
  EXPECT_NEAR(fused.covered_mm2, 4 * 5 + 4 * 6 + 5 * 6, 1e-9);
  EXPECT_NEAR(fused.added_mm2, 600 - fused.covered_mm2, 1e-9);
  EXPECT_TRUE(BorderEdges(fused.mesh).empty());
}

TEST(FuseMeshes, TheOrderOfTwoClosedMeshesDoesNotMatter) {
  const TriMesh a = testing::SphereMesh({0, 0, 0}, 50, 20);
  const TriMesh b = testing::SphereMesh({41, 3, 5}, 30, 17);
  const FusedMesh ab = FuseMeshes(a, b), ba = FuseMeshes(b, a);
  EXPECT_NEAR(SignedVolume(ab.mesh), SignedVolume(ba.mesh), 1e-6);
  EXPECT_GT(SignedVolume(ab.mesh), std::max(SignedVolume(a), SignedVolume(b)));
  EXPECT_NEAR(ab.added_mm2, Area(b) - ba.covered_mm2, 1e-6);
}

// The cap of the ball above the plate is 2 pi r h, and it covers a disc of radius sqrt(r^2 - d^2).
TEST(FuseMeshes, AnOpenBodyGainsTheCapOfABall) {
  const FusedMesh fused = FuseMeshes(kPlate, Ball());
  EXPECT_NEAR(fused.added_mm2, 2 * kPi * 20 * 15, 8);
  EXPECT_NEAR(fused.covered_mm2, kPi * (400 - 25), 8);
  EXPECT_NEAR(Area(fused.mesh), 1e4 - fused.covered_mm2 + fused.added_mm2, 1e-6);
  EXPECT_EQ(BorderEdges(fused.mesh).size(), BorderEdges(kPlate).size());
  const EdgeReport edges = CheckEdges(fused.mesh);
  EXPECT_EQ(edges.non_manifold + edges.inconsistent, 0);
}

TEST(FuseMeshes, AnOpenFeatureFusesAsTheClosedOneDoes) {
  const FusedMesh closed = FuseMeshes(kPlate, Ball());
  const FusedMesh open = FuseMeshes(kPlate, Above(Ball(), -6));
  EXPECT_NEAR(open.covered_mm2, closed.covered_mm2, 1e-9);
  EXPECT_NEAR(open.added_mm2, closed.added_mm2, 1e-9);
  EXPECT_EQ(BorderEdges(open.mesh).size(), BorderEdges(kPlate).size());
}

TEST(FuseMeshes, TwoFeaturesOneAfterTheOther) {
  const TriMesh left = testing::SphereMesh({25, 50, -2}, 10, 20);
  const TriMesh right = testing::SphereMesh({75, 50, -2}, 10, 20);
  const FusedMesh both = FuseMeshes(kPlate, testing::Joined(left, right));
  const FusedMesh twice = FuseMeshes(FuseMeshes(kPlate, left).mesh, right);
  EXPECT_NEAR(Area(both.mesh), Area(twice.mesh), 1e-6);
  EXPECT_NEAR(both.added_mm2, 2 * twice.added_mm2, 1e-6);
}

TEST(FuseMeshes, RefusesWhatCannotBeFused) {
  ExpectRefused(kPlate, testing::SphereMesh({50, 50, 30}, 20, 20), "does not meet the body");
  ExpectRefused(kPlate, testing::SphereMesh({0, 50, -5}, 20, 20), "curve that ends");
  ExpectRefused(kPlate, testing::Joined(Ball(), testing::SphereMesh({50, 50, 40}, 5, 8)),
                "a piece of the feature does not meet");
  ExpectRefused(kPlate, InsideOut(Ball()), "counter-clockwise seen from outside");
  ExpectRefused(testing::Joined(kPlate, testing::SphereMesh({20, 20, 0.1}, 6, 9)),
                testing::SphereMesh({26, 21, 0}, 5, 8), "meets itself");
  ExpectRefused(Cube({0, 0, 0}, 10), Cube({10, 2, 2}, 5), "lie on each other or touch");
  TriMesh turned = Ball();
  std::swap(turned.triangles[70][0], turned.triangles[70][1]);
  ExpectRefused(kPlate, turned, "not a consistently oriented manifold");
}

}  // namespace
}  // namespace semblance::surfaces
