// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/refine_mesh.h"

#include <gtest/gtest.h>

#include "surfaces/mesh/mesh_primitives.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::surfaces {
namespace {

double Area_mm2(const TriMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    sum += TriangleAreaVector(mesh, t).norm();
  }
  return sum;
}

TEST(RefineMesh, KeepsTheSurface) {
  const TriMesh ball = MakeSphere(Vec3(1, 2, 3), 10, 6), fine = RefineTo(ball, 2);
  EXPECT_GT(fine.triangles.size(), ball.triangles.size());
  EXPECT_NEAR(Area_mm2(fine), Area_mm2(ball), 1e-9);
  const MeshQuery surface(ball);
  for (const Vec3& p : fine.points) {
    EXPECT_LT(surface.Closest(p).distance_mm, 1e-9);
  }
  for (std::size_t v = 0; v < ball.points.size(); ++v) {
    EXPECT_EQ(fine.points[v], ball.points[v]);
  }
}

// V - E + T of a closed surface without holes is 2, so each middle is one point.
TEST(RefineMesh, NeighboursShareTheirMiddles) {
  const TriMesh fine = RefineTo(MakeSphere(Vec3::Zero(), 10, 6), 2);
  const auto triangles = std::ssize(fine.triangles);
  EXPECT_EQ(std::ssize(fine.points) - 3 * triangles / 2 + triangles, 2);
}

TEST(RefineMesh, AMeshAndItsRefinementBecomeEqual) {
  const TriMesh ball = MakeSphere(Vec3::Zero(), 10, 6);
  const TriMesh once = RefineTo(ball, 3.5), twice = RefineTo(ball, 2);
  ASSERT_LT(once.triangles.size(), twice.triangles.size());
  const TriMesh again = RefineTo(once, 2);
  EXPECT_EQ(again.points, twice.points);
  EXPECT_EQ(again.triangles, twice.triangles);
}

TEST(RefineMesh, AFineMeshAndAnEmptyOneStayAsTheyAre) {
  const TriMesh ball = MakeSphere(Vec3::Zero(), 10, 6);
  EXPECT_EQ(RefineTo(ball, 20).triangles, ball.triangles);
  EXPECT_TRUE(RefineTo(TriMesh{}, 1).triangles.empty());
}

TEST(RefineMesh, AMeshOfAnotherUnitDoesNotFillTheMemory) {
  EXPECT_LT(RefineTo(MakeSphere(Vec3::Zero(), 1e6, 6), 1).triangles.size(), 1100000u);
}

}  // namespace
}  // namespace semblance::surfaces
