// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/mesh_query.h"

#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using testing::Plate;
using testing::SphereMesh;

// Oracle: the nearest of many points spread over each triangle.
double SampledDistance(const TriMesh& mesh, const Vec3& p) {
  double nearest = std::numeric_limits<double>::infinity();
  constexpr int kSteps = 24;
  for (const Triangle& t : mesh.triangles) {
    for (int a = 0; a <= kSteps; ++a) {
      for (int b = 0; a + b <= kSteps; ++b) {
        const double u = double(a) / kSteps, v = double(b) / kSteps;
        const Vec3 q =
            (1 - u - v) * mesh.points[t[0]] + u * mesh.points[t[1]] + v * mesh.points[t[2]];
        nearest = std::min(nearest, (p - q).norm());
      }
    }
  }
  return nearest;
}

TEST(MeshQuery, ClosestPointAgreesWithDenseSampling) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 10, 8);
  const MeshQuery query(sphere);
  Random random(7);
  for (int i = 0; i < 50; ++i) {
    const Vec3 p = random.InBox(-15, 15);
    const MeshPoint closest = query.Closest(p);
    const double sampled = SampledDistance(sphere, p);
    EXPECT_LE(closest.distance_mm, sampled + 1e-12);
    EXPECT_NEAR(closest.distance_mm, sampled, 0.1);
    EXPECT_NEAR((closest.position - p).norm(), closest.distance_mm, 1e-12);
  }
}

TEST(MeshQuery, APointIsTheWeightedSumOfItsTrianglesCorners) {
  const TriMesh sphere = SphereMesh({3, -2, 5}, 10, 8);
  const MeshQuery query(sphere);
  Random random(8);
  const auto check = [&](const MeshPoint& at) {
    const Triangle& t = sphere.triangles[at.triangle];
    const Vec3 sum = at.weights[0] * sphere.points[t[0]] + at.weights[1] * sphere.points[t[1]] +
                     at.weights[2] * sphere.points[t[2]];
    EXPECT_LT((sum - at.position).norm(), 1e-12);
    EXPECT_GE(at.weights.minCoeff(), 0);
    EXPECT_NEAR(at.weights.sum(), 1, 1e-14);
  };
  for (int i = 0; i < 50; ++i) {
    check(query.Closest(random.InBox(-15, 15)));
    for (const MeshPoint& hit : query.AllHits({3, -2, 5}, random.Direction(), 100)) {
      check(hit);
    }
  }
  check(query.Closest(2 * sphere.points[7] - Vec3(3, -2, 5)));  // a corner, straight above it
}

// CGAL's own answer for a triangle whose corners lie on a line is undefined.
TEST(MeshQuery, ARayPassesATriangleWithoutArea) {
  TriMesh mesh = Plate(10, 3);
  const int corner = int(mesh.points.size());
  mesh.points.insert(mesh.points.end(), {{1, 1, 2}, {3, 1, 2}, {2, 1, 2}});
  mesh.triangles.push_back({corner, corner + 1, corner + 2});
  mesh.triangles.push_back({corner, corner, corner});
  const MeshQuery query(mesh);
  for (const Vec3& from : {Vec3(2, 1, 5), Vec3(1, 1, 5), Vec3(2.5, 1, 5)}) {
    const auto hits = query.AllHits(from, {0, 0, -1}, 100);
    ASSERT_FALSE(hits.empty());
    EXPECT_NEAR(hits.front().distance_mm, 5, 1e-12);
  }
  EXPECT_TRUE(query.AllHits({0, 1, 2}, {1, 0, 0}, 9).empty());  // along it
  EXPECT_TRUE(query.AllHits({2, 1, 2}, {0, 0, -1}, 0).empty());
  EXPECT_NEAR(query.Closest({2, 1, 2.5}).distance_mm, 0.5, 1e-12);
}

TEST(MeshQuery, RayThroughAPlateHitsItOnce) {
  const MeshQuery query(Plate(10, 3));
  const auto hit = query.FirstHit({4.1, 2.3, 5}, {0, 0, -2}, 100);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance_mm, 5, 1e-12);
  EXPECT_LT((hit->position - Vec3(4.1, 2.3, 0)).norm(), 1e-12);
  EXPECT_FALSE(query.FirstHit({4.1, 2.3, 5}, {0, 0, 1}, 100));
  EXPECT_FALSE(query.FirstHit({4.1, 2.3, 5}, {0, 0, -1}, 4.9));
}

TEST(MeshQuery, RayThroughASphereGoesInAndOut) {
  const MeshQuery query(SphereMesh({0, 0, 0}, 10, 32));
  const auto hits = query.AllHits({-20, 0.3, 0.2}, {1, 0, 0}, 100);
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_LT(hits[0].distance_mm, hits[1].distance_mm);
}

TEST(MeshQuery, RefusesAMeshThatCannotBeSearched) {
  EXPECT_THROW(MeshQuery(TriMesh{}), InputError);
  TriMesh mesh = Plate(1, 1);
  mesh.points[2].x() = kNaN;
  EXPECT_THROW({ MeshQuery query(mesh); }, InputError);
}

}  // namespace
}  // namespace semblance
