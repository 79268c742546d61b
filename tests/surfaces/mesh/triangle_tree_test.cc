// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/triangle_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::SphereMesh;

// Triangles that neither touch nor face alike, with a few of no area.
TriMesh Confetti(int count) {
  Random random(3);
  TriMesh mesh;
  for (int t = 0; t < count; ++t) {
    const Vec3 at = random.InBox(-10, 10);
    for (int c = 0; c < 3; ++c) {
      mesh.points.push_back(t % 17 == 0 ? at : Vec3(at + random.InBox(-1, 1)));
    }
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return mesh;
}

double DistanceTo(const TriMesh& mesh, std::size_t triangle, const Vec3& p) {
  const auto [a, b, c] = mesh.triangles[triangle];
  const Vec3 at =
      ClosestPointOnTriangle(p, mesh.points[a], mesh.points[b], mesh.points[c]).position;
  return (at - p).norm();
}

// Oracle: looks at every triangle.
double DistanceToAll(const TriMesh& mesh, const Vec3& p) {
  double least = DistanceTo(mesh, 0, p);
  for (std::size_t t = 1; t < mesh.triangles.size(); ++t) {
    least = std::min(least, DistanceTo(mesh, t, p));
  }
  return least;
}

TEST(TriangleTree, NoTriangleIsNearerThanTheNearest) {
  Random random(4);
  for (const TriMesh& mesh :
       {Confetti(500), SphereMesh({1, 2, 3}, 10, 12), SphereMesh({0, 0, 0}, 1e4, 3)}) {
    const TriangleTree tree(mesh);
    for (int k = 0; k < 500; ++k) {
      const Vec3 p = random.InBox(-15, 15);
      const double least = DistanceToAll(mesh, p);
      EXPECT_NEAR(DistanceTo(mesh, static_cast<std::size_t>(tree.Nearest(p)), p), least,
                  1e-12 * (1 + least));
    }
  }
}

TEST(TriangleTree, OfTheTrianglesAtACornerTheFirstIsNearest) {
  const TriMesh sphere = SphereMesh({1, 2, 3}, 10, 12);
  const TriangleTree tree(sphere);
  std::vector<int> first(sphere.points.size(), -1);
  for (std::size_t t = sphere.triangles.size(); t-- > 0;) {
    for (const std::int32_t corner : sphere.triangles[t]) {
      first[corner] = static_cast<int>(t);
    }
  }
  for (std::size_t v = 0; v < sphere.points.size(); ++v) {
    EXPECT_EQ(tree.Nearest(sphere.points[v]), first[v]);
  }
}

// Oracle: the plane of each triangle meets the ray at a point whose weights are >= 0.
std::set<int> HitsOfAll(const TriMesh& mesh, const Vec3& origin, const Vec3& direction) {
  std::set<int> hits;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3& a = mesh.points[mesh.triangles[t][0]];
    Mat3 columns;
    columns << mesh.points[mesh.triangles[t][1]] - a, mesh.points[mesh.triangles[t][2]] - a,
        -direction;
    if (columns.determinant() == 0) {
      continue;
    }
    const Vec3 x = columns.inverse() * (origin - a);
    if (x[0] >= 0 && x[1] >= 0 && x[0] + x[1] <= 1 && x[2] >= 0 && x[2] <= 1) {
      hits.insert(static_cast<int>(t));
    }
  }
  return hits;
}

TEST(TriangleTree, TheHitsAreThoseOfAllTrianglesAndTheFirstIsOneOfThem) {
  Random random(5);
  const TriMesh mesh = Confetti(2000);
  const TriangleTree tree(mesh);
  int found = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 origin = random.InBox(-15, 15);
    const Vec3 direction = k % 10 == 0 ? Vec3(0, -25, 0) : Vec3(30 * random.Direction());
    std::set<int> hits;
    double first = 2;
    for (const RayHit& hit : tree.AllHits(origin, direction)) {
      EXPECT_TRUE(hits.insert(hit.triangle).second);
      first = std::min(first, hit.along);
      const auto& [a, b, c] = tree.Corners(hit.triangle);
      const Vec3 at = hit.weights[0] * a + hit.weights[1] * b + hit.weights[2] * c;
      EXPECT_LT((at - (origin + hit.along * direction)).norm(), 1e-9);
    }
    EXPECT_EQ(hits, HitsOfAll(mesh, origin, direction));
    const RayHit hit = tree.FirstHit(origin, direction);
    EXPECT_EQ(hit.triangle >= 0, !hits.empty());
    if (!hits.empty()) {
      EXPECT_EQ(hit.along, first);
      EXPECT_TRUE(hits.contains(hit.triangle));
    }
    found += static_cast<int>(hits.size());
  }
  EXPECT_GT(found, 80);
}

TEST(TriangleTree, NoRayLeavesAClosedSurfaceBetweenItsTriangles) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 10, 24);
  const TriangleTree tree(sphere);
  Random random(6);
  for (const Triangle& t : sphere.triangles) {
    const Vec3 from = random.InBox(-1, 1);
    for (int c = 0; c < 3; ++c) {
      const Vec3 &a = sphere.points[t[c]], &b = sphere.points[t[(c + 1) % 3]];
      for (const Vec3& on_edge : {a, Vec3(0.5 * (a + b)), Vec3(a + 0.3 * (b - a))}) {
        EXPECT_GE(tree.FirstHit(from, 2 * (on_edge - from)).triangle, 0);
      }
    }
  }
}

TEST(TriangleTree, ARayInTheSideOfABoxMeetsTheTriangleThere) {
  const TriMesh plate = testing::Plate(8, 8);  // its corners are whole numbers
  const TriangleTree tree(plate);
  for (const Vec3& corner : plate.points) {
    for (const double way : {-10, 10}) {
      EXPECT_GE(tree.FirstHit(corner - Vec3(0, 0, way / 2), {0.0, -0.0, way}).triangle, 0);
    }
  }
}

TEST(TriangleTree, ARayThroughACornerOfABorderMeetsIt) {
  Random random(8);
  for (int k = 0; k < 1000; ++k) {
    const TriMesh one{.points = {random.InBox(-9, 9), random.InBox(-9, 9), random.InBox(-9, 9)},
                      .triangles = {{0, 1, 2}}};
    const TriangleTree tree(one);
    const Vec3 direction = 20 * random.Direction();
    for (const Vec3& corner : one.points) {
      const RayHit hit = tree.FirstHit(corner - 0.5 * direction, direction);
      ASSERT_EQ(hit.triangle, 0);
      EXPECT_NEAR(hit.along, 0.5, 1e-9);
      EXPECT_GE(hit.weights.minCoeff(), 0);
    }
  }
}

}  // namespace
}  // namespace semblance::surfaces
