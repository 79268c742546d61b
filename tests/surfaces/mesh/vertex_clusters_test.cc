// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/vertex_clusters.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

TEST(VertexClusters, NothingMovesFurtherThanItsCell) {
  const TriMesh fine = testing::SphereMesh(Vec3::Zero(), 40, 60);
  constexpr double kCell_mm = 4;
  const TriMesh coarse = ClusterVertices(fine, kCell_mm);
  EXPECT_LT(coarse.points.size(), fine.points.size() / 2);
  const MeshQuery query(coarse);
  for (const Vec3& p : fine.points) {
    EXPECT_LE(query.Closest(p).distance_mm, std::sqrt(3.0) * kCell_mm);
  }
}

TEST(VertexClusters, FineCellsKeepTheMesh) {
  const TriMesh mesh = testing::SphereMesh(Vec3::Zero(), 40, 10);
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
  EXPECT_THROW(ClusterVertices(testing::SphereMesh(Vec3::Zero(), 40, 10), 0), InputError);
}

}  // namespace
}  // namespace semblance
