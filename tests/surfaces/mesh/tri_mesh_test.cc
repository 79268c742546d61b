// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/tri_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_primitives.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::Plate;
using testing::SphereMesh;

TEST(TriMesh, SphereHasTheVolumeAndAreaOfItsBall) {
  const TriMesh sphere = SphereMesh({1, 2, 3}, 10, 64);
  EXPECT_NEAR(SignedVolume(sphere), 4.0 / 3.0 * std::numbers::pi * 1000, 10);
  EXPECT_NEAR(Area(sphere), 4 * std::numbers::pi * 100, 2);
}

TEST(TriMesh, VertexNormalsOfASpherePointAwayFromItsCenter) {
  const Vec3 center(1, 2, 3);
  const TriMesh sphere = SphereMesh(center, 10, 32);
  const std::vector<Vec3> normals = VertexNormals(sphere);
  for (std::size_t v = 0; v < sphere.points.size(); ++v) {
    EXPECT_GT(normals[v].dot((sphere.points[v] - center) / 10), 0.999);
    EXPECT_NEAR(normals[v].norm(), 1, 1e-12);
  }
}

TEST(TriMesh, VertexWithoutTrianglesHasZeroNormal) {
  TriMesh mesh = Plate(1, 1);
  mesh.points.emplace_back(9, 9, 9);
  EXPECT_EQ(VertexNormals(mesh).back(), Vec3(Vec3::Zero()));
}

TEST(TriMesh, EdgesOfAClosedMeshArePairedAndConsistent) {
  const EdgeReport report = CheckEdges(SphereMesh({0, 0, 0}, 1, 8));
  EXPECT_GT(report.edges, 0);
  EXPECT_EQ(report.boundary, 0);
  EXPECT_EQ(report.non_manifold, 0);
  EXPECT_EQ(report.inconsistent, 0);
}

TEST(TriMesh, EdgeDefectsAreCounted) {
  TriMesh mesh = Plate(1, 1);
  EXPECT_EQ(CheckEdges(mesh).boundary, 4);
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  EXPECT_EQ(CheckEdges(mesh).inconsistent, 1);
  mesh.triangles.push_back(mesh.triangles[0]);
  EXPECT_EQ(CheckEdges(mesh).non_manifold, 1);
}

TEST(TriMesh, TwoSpheresAreTwoComponentsAndEachCanBeTaken) {
  TriMesh both = SphereMesh({0, 0, 0}, 1, 8);
  const TriMesh second = SphereMesh({5, 0, 0}, 2, 8);
  Append(both, second);
  const Components components = ConnectedComponents(both);
  ASSERT_EQ(components.count, 2);
  std::vector<bool> keep;
  for (const int component : components.of_triangle) {
    keep.push_back(component == 1);
  }
  const TriMesh taken = Submesh(both, keep);
  EXPECT_EQ(taken.points.size(), second.points.size());
  EXPECT_EQ(taken.triangles, second.triangles);
}

TEST(TriMesh, UnusedPointsAreDroppedAndTheOthersKeepTheirOrder) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 1, 0}, {4, 0, 0}};
  TriMesh mesh{points, {{4, 1, 3}}};
  EXPECT_EQ(DropUnusedPoints(mesh), (std::vector<std::int32_t>{1, 3, 4}));
  EXPECT_EQ(mesh.points, (std::vector<Vec3>{points[1], points[3], points[4]}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{2, 0, 1}}));
  EXPECT_EQ(DropUnusedPoints(mesh), (std::vector<std::int32_t>{0, 1, 2}));
}

TEST(VertexClusters, NothingMovesFurtherThanItsCell) {
  const TriMesh fine = SphereMesh(Vec3::Zero(), 40, 60);
  constexpr double kCell_mm = 4;
  const TriMesh coarse = ClusterVertices(fine, kCell_mm);
  EXPECT_LT(coarse.points.size(), fine.points.size() / 2);
  const MeshQuery query(coarse);
  for (const Vec3& p : fine.points) {
    EXPECT_LE(query.Closest(p).distance_mm, std::sqrt(3.0) * kCell_mm);
  }
}

TEST(VertexClusters, FineCellsKeepTheMesh) {
  const TriMesh mesh = SphereMesh(Vec3::Zero(), 40, 10);
  const TriMesh same = ClusterVertices(mesh, 0.01);
  EXPECT_EQ(same.points.size(), mesh.points.size());
  EXPECT_EQ(same.triangles, mesh.triangles);
}

// A plate of 1 mm seen from both sides, in cells of 3 mm.
TEST(VertexClusters, TheSidesOfAThinWallStayApart) {
  TriMesh wall;
  for (const double z : {0.2, 1.2}) {
    const auto first = static_cast<std::int32_t>(wall.points.size());
    for (int k = 0; k < 4; ++k) {
      wall.points.emplace_back(k % 2 * 10.0, k / 2 * 10.0, z);
    }
    if (z > 1) {
      wall.triangles.push_back({first, first + 1, first + 2});
      wall.triangles.push_back({first + 1, first + 3, first + 2});
    } else {
      wall.triangles.push_back({first, first + 2, first + 1});
      wall.triangles.push_back({first + 1, first + 2, first + 3});
    }
  }
  const TriMesh coarse = ClusterVertices(wall, 3);
  EXPECT_EQ(coarse.points.size(), 8u);
  EXPECT_EQ(coarse.triangles.size(), 4u);
}

TEST(VertexClusters, ACellMustHaveASize) {
  EXPECT_THROW(ClusterVertices(SphereMesh(Vec3::Zero(), 40, 10), 0), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
