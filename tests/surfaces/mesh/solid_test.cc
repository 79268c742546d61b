// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/solid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::Joined;
using testing::Plate;
using testing::SphereMesh;

// Oracle: the sum of the solid angles of all triangles seen from p (van Oosterom & Strackee 1983),
// in turns: 1 inside and 0 outside.
double WindingNumber(const TriMesh& mesh, const Vec3& p) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.points[t[0]] - p, b = mesh.points[t[1]] - p, c = mesh.points[t[2]] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

// A ball with spikes and dents, whose edges and vertices are sharp in both directions.
TriMesh SpikyBall() {
  TriMesh ball = SphereMesh({1, 2, 3}, 10, 8);
  Random random(5);
  for (Vec3& p : ball.points) {
    p = Vec3(1, 2, 3) + random.Uniform(0.35, 1.6) * (p - Vec3(1, 2, 3));
  }
  return ball;
}

TriMesh TurnedInsideOut(TriMesh mesh) {
  for (Triangle& t : mesh.triangles) {
    std::swap(t[0], t[1]);
  }
  return mesh;
}

TEST(Solid, AgreesWithTheSumOfSolidAngles) {
  const TriMesh mesh = Joined(SpikyBall(), SphereMesh({40, 0, 0}, 6, 5));
  ASSERT_TRUE(BoundsSolid(mesh));
  const Solid solid(mesh);
  Random random(6);
  int inside = 0;
  for (int k = 0; k < 4000; ++k) {
    const Vec3 p = k % 2 == 0 ? random.InBox(-18, 18) : Vec3(40, 0, 0) + random.InBox(-8, 8);
    const bool expected = WindingNumber(mesh, p) > 0.5;
    inside += expected ? 1 : 0;
    EXPECT_EQ(solid.Contains(p), expected) << p.transpose();
  }
  EXPECT_GT(inside, 500);
  EXPECT_LT(inside, 3500);
}

// Rays and closest points have their special cases there.
TEST(Solid, DecidesNextToVerticesAndEdges) {
  const TriMesh mesh = SpikyBall();
  const Solid solid(mesh);
  Random random(7);
  const auto check = [&](const Vec3& at) {
    const Vec3 p = at + random.InBox(-0.05, 0.05);
    EXPECT_EQ(solid.Contains(p), WindingNumber(mesh, p) > 0.5) << p.transpose();
  };
  for (const Triangle& t : mesh.triangles) {
    check(mesh.points[t[0]]);
    check(0.5 * (mesh.points[t[0]] + mesh.points[t[1]]));
  }
}

TEST(BoundsSolid, WantsClosedPartsThatFaceOutward) {
  const TriMesh ball = SphereMesh({0, 0, 0}, 10, 8), small = SphereMesh({0, 0, 0}, 4, 6);
  EXPECT_TRUE(BoundsSolid(ball));
  EXPECT_TRUE(BoundsSolid(Joined(ball, SphereMesh({30, 0, 0}, 4, 6))));
  EXPECT_FALSE(BoundsSolid(TurnedInsideOut(ball)));
  EXPECT_FALSE(BoundsSolid(Joined(ball, TurnedInsideOut(small))));  // a cavity
  EXPECT_FALSE(BoundsSolid(Plate(10, 3)));
  EXPECT_FALSE(BoundsSolid(TriMesh{}));
  TriMesh open = ball;
  open.triangles.pop_back();
  EXPECT_FALSE(BoundsSolid(open));
}

TEST(EnclosedVolumes, AreThoseOfTheParts) {
  const TriMesh mesh =
      Joined(SphereMesh({0, 0, 0}, 10, 60), TurnedInsideOut(SphereMesh({30, 0, 0}, 5, 60)));
  const std::vector<double> volumes = EnclosedVolumes(mesh, ConnectedComponents(mesh));
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_NEAR(volumes[0], 4.0 / 3 * std::numbers::pi * 1000, 10);
  EXPECT_NEAR(volumes[1], -4.0 / 3 * std::numbers::pi * 125, 2);
}

}  // namespace
}  // namespace semblance::surfaces
