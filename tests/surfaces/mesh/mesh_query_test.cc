// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/mesh_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::Joined;
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

// A mesh that is crushed to a point, beside one triangle.
TEST(MeshQuery, TrianglesNearMissNoneWithinTheDistance) {
  const TriMesh sphere = SphereMesh({1, 2, 3}, 10, 32);
  const MeshQuery query(sphere);
  for (const double distance_mm : {0.0, 0.3, 4.0, 50.0}) {
    const Vec3 p(8, 2, 10);
    const std::vector<int> near = query.TrianglesNear(p, distance_mm);
    EXPECT_TRUE(std::ranges::is_sorted(near));
    for (int t = 0; t < static_cast<int>(sphere.triangles.size()); ++t) {
      const auto& [a, b, c] = sphere.triangles[t];
      const TrianglePoint closest =
          ClosestPointOnTriangle(p, sphere.points[a], sphere.points[b], sphere.points[c]);
      if ((closest.position - p).norm() <= distance_mm) {
        EXPECT_TRUE(std::ranges::binary_search(near, t)) << t;
      }
    }
  }
  EXPECT_LT(query.TrianglesNear({8, 2, 10}, 0.3).size(), 40u);  // most are left out
}

TEST(MeshQuery, ManyTrianglesAtOnePlace) {
  TriMesh mesh{.points = {{1, 2, 3}, {11, 2, 3}, {1, 12, 3}}, .triangles = {{0, 1, 2}}};
  mesh.triangles.resize(200000, {0, 0, 0});
  EXPECT_NEAR(MeshQuery(mesh).Closest({2, 3, 8}).distance_mm, 5, 1e-12);
}

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

TriMesh TurnedOver(TriMesh mesh) {
  for (Triangle& t : mesh.triangles) {
    std::swap(t[1], t[2]);
  }
  return mesh;
}

TEST(OuterSurface, AllOfAConvexBodyIsSeen) {
  const std::vector<bool> seen = SeenFromOutside(SphereMesh({5, -3, 100}, 80, 20), 2);
  EXPECT_EQ(std::ranges::count(seen, false), 0);
}

TEST(OuterSurface, TheWallOfACavityAndAnInnerLayerAreNotSeen) {
  const TriMesh outer = SphereMesh({0, 0, 0}, 80, 20), inner = SphereMesh({0, 0, 0}, 60, 16);
  for (const TriMesh& wall : {TurnedOver(inner), inner}) {
    const std::vector<bool> seen = SeenFromOutside(Joined(outer, wall), 1);
    for (std::size_t t = 0; t < seen.size(); ++t) {
      EXPECT_EQ(seen[t], t < outer.triangles.size()) << t;
    }
  }
}

// A floor at z = 0 and four walls of this height, all facing inwards.
TriMesh Well(double size, double height) {
  TriMesh well = Plate(size, 1);
  const Vec3 middle(size / 2, size / 2, 0);
  for (int side = 0; side < 4; ++side) {
    TriMesh wall = Plate(1, 1);
    for (Vec3& p : wall.points) {
      p = Vec3(size * p.x(), size, height * p.y()) - middle;
      p = Eigen::AngleAxisd(side * EIGEN_PI / 2, Vec3::UnitZ()) * p + middle;
    }
    well = Joined(std::move(well), wall);
  }
  return well;
}

TEST(OuterSurface, TheFloorOfAWellIsSeenUntilItHasALid) {
  const TriMesh open = Well(20, 15);
  EXPECT_TRUE(SeenFromOutside(open, 1)[0]);
  TriMesh lid = TurnedOver(Plate(20, 1));
  for (Vec3& p : lid.points) {
    p.z() = 15;
  }
  const std::vector<bool> seen = SeenFromOutside(Joined(open, lid), 1);
  EXPECT_EQ(std::ranges::count(seen, true), 0);
}

TEST(OuterSurface, TheNumberOfThreadsDoesNotMatter) {
  const TriMesh mesh = Joined(SphereMesh({0, 0, 0}, 80, 16), SphereMesh({70, 0, 0}, 40, 12));
  EXPECT_EQ(SeenFromOutside(mesh, 1), SeenFromOutside(mesh, 3));
}

TEST(OuterSurface, ATriangleWithoutAreaIsNotSeenAndAMeshWithoutTrianglesIsRefused) {
  TriMesh mesh = Plate(10, 1);
  mesh.triangles.push_back({0, 1, 1});
  EXPECT_FALSE(SeenFromOutside(mesh, 1).back());
  EXPECT_THROW(SeenFromOutside({}, 1), InputError);
}

// Points in clusters, some of them twice.
std::vector<Vec3> Clusters() {
  Random random(1);
  std::vector<Vec3> points;
  for (int k = 0; k < 20; ++k) {
    const Vec3 centre = random.InBox(-50, 50);
    for (int m = 0; m < 30; ++m) {
      points.push_back(centre + random.InBox(-1, 1));
    }
    points.push_back(points.back());
  }
  return points;
}

TEST(PointQuery, FindsWhatLookingAtEveryPointFinds) {
  const std::vector<Vec3> points = Clusters();
  const PointQuery query(points);
  Random random(2);
  for (int k = 0; k < 200; ++k) {
    const Vec3 p = k % 2 == 0 ? random.InBox(-60, 60) : points[k];
    std::vector<double> distances;
    for (const Vec3& point : points) {
      distances.push_back((point - p).norm());
    }
    std::ranges::sort(distances);
    for (const int rank : {1, 2, 9, static_cast<int>(points.size())}) {
      EXPECT_NEAR(query.DistanceTo(p, rank), distances[rank - 1], 1e-12) << k << ' ' << rank;
    }
  }
}

TEST(PointQuery, APointThatIsNotThereIsInfinitelyFar) {
  const std::vector<Vec3> points = {Vec3(1, 2, 3)};
  EXPECT_EQ(PointQuery(points).DistanceTo(Vec3(1, 2, 5)), 2);
  EXPECT_TRUE(std::isinf(PointQuery(points).DistanceTo(Vec3(1, 2, 5), 2)));
}

TEST(PointQuery, PointsThatCoincideAreFound) {
  const std::vector<Vec3> points(1000, Vec3(1, 0, 0));
  EXPECT_EQ(PointQuery(points).DistanceTo(Vec3::Zero(), 1000), 1);
}

TEST(PointQuery, RefusesNoneAndNotFinite) {
  EXPECT_THROW(PointQuery({}), InputError);
  const std::vector<Vec3> points = {Vec3::Zero(), Vec3(0, kNaN, 0)};
  EXPECT_THROW(PointQuery{points}, InputError);
}

}  // namespace
}  // namespace semblance::surfaces
