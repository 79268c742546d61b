// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/point_triangle.h"

#include <gtest/gtest.h>

#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

void ExpectLawful(const TrianglePoint& on, const Vec3& a, const Vec3& b, const Vec3& c) {
  EXPECT_GE(on.weights.minCoeff(), 0);
  EXPECT_NEAR(on.weights.sum(), 1, 1e-12);
  const Vec3 weighted = on.weights[0] * a + on.weights[1] * b + on.weights[2] * c;
  EXPECT_LT((weighted - on.position).norm(), 1e-9);
}

TEST(PointTriangle, AgreesWithTheSearchTree) {
  Random random(3);
  for (int n = 0; n < 2000; ++n) {
    const Vec3 a = random.InBox(-10, 10), b = random.InBox(-10, 10), c = random.InBox(-10, 10);
    const MeshQuery query(TriMesh{{a, b, c}, {{0, 1, 2}}});
    const Vec3 p = random.InBox(-20, 20);
    const TrianglePoint on = ClosestPointOnTriangle(p, a, b, c);
    ExpectLawful(on, a, b, c);
    EXPECT_LT((on.position - query.Closest(p).position).norm(), 1e-7);
  }
}

TEST(PointTriangle, FindsInteriorEdgeAndCorner) {
  const Vec3 a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);
  EXPECT_EQ(ClosestPointOnTriangle({1, 2, 7}, a, b, c).weights, Vec3(0.25, 0.25, 0.5));
  EXPECT_EQ(ClosestPointOnTriangle({1, -5, 1}, a, b, c).weights, Vec3(0.75, 0.25, 0));
  EXPECT_EQ(ClosestPointOnTriangle({-1, -1, 1}, a, b, c).weights, Vec3(1, 0, 0));
}

TEST(PointTriangle, WithoutAreaIsItsEdgesAndCorners) {
  const Vec3 a(0, 0, 0), b(4, 0, 0), c(1, 0, 0);
  const TrianglePoint on = ClosestPointOnTriangle({3, 2, 0}, a, b, c);
  ExpectLawful(on, a, b, c);
  EXPECT_LT((on.position - Vec3(3, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(ClosestPointOnTriangle({3, 2, 0}, b, b, b).position, b);
}

}  // namespace
}  // namespace semblance
