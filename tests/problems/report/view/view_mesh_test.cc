// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/view/view_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using testing::SphereMesh;

// The largest distance from a vertex of one mesh to the other mesh.
double FarthestVertex_mm(const TriMesh& from, const TriMesh& to) {
  const MeshQuery query(to);
  double farthest_mm = 0;
  for (const Vec3& point : from.points) {
    farthest_mm = std::max(farthest_mm, (query.Closest(point).position - point).norm());
  }
  return farthest_mm;
}

TEST(SimplifyForView, StaysOnASphereWhereverItLies) {
  for (const Vec3& centre : {Vec3(0, 0, 0), Vec3(650000, 5480000, -30)}) {
    const TriMesh sphere = SphereMesh(centre, 80, 200);
    const TriMesh simple = SimplifyForView(sphere, 5000);
    EXPECT_LE(simple.triangles.size(), 5000u);
    EXPECT_GE(simple.triangles.size(), 4000u);
    // Triangles of an even sphere with 5,000 of them have a chord error of 0.12 mm.
    EXPECT_LT(FarthestVertex_mm(sphere, simple), 0.5) << centre.transpose();
    EXPECT_LT(FarthestVertex_mm(simple, sphere), 1e-9) << centre.transpose();
  }
}

TEST(SimplifyForView, LeavesASmallMeshAlone) {
  const TriMesh sphere = SphereMesh(Vec3::Zero(), 80, 20);
  const TriMesh same = SimplifyForView(sphere, static_cast<int>(sphere.triangles.size()));
  EXPECT_EQ(same.points, sphere.points);
  EXPECT_EQ(same.triangles, sphere.triangles);
}

TEST(SimplifyForView, GivesUpSmallPiecesOnlyWhereTheyAreTooMany) {
  TriMesh pieces;
  for (int k = 0; k < 1000; ++k) {
    const auto first = static_cast<std::int32_t>(pieces.points.size());
    const TriMesh piece =
        SphereMesh(Vec3(10.0 * (k % 10), 10.0 * (k / 10 % 10), 10.0 * (k / 100)), 3, 6);
    pieces.points.insert(pieces.points.end(), piece.points.begin(), piece.points.end());
    for (const auto& [a, b, c] : piece.triangles) {
      pieces.triangles.push_back({a + first, b + first, c + first});
    }
  }
  const TriMesh simple = SimplifyForView(pieces, 1500);
  EXPECT_LE(simple.triangles.size(), 3000u);
  EXPECT_GT(simple.triangles.size(), 100u);
}

TEST(SimplifyForView, TakesAMeshThatIsNotAManifold) {
  TriMesh fan = SphereMesh(Vec3::Zero(), 80, 100);
  const auto [a, b, c] = fan.triangles.front();
  fan.triangles.push_back({a, b, static_cast<std::int32_t>(fan.points.size() / 2)});
  fan.triangles.push_back({c, b, a});
  const TriMesh simple = SimplifyForView(fan, 3000);
  EXPECT_LE(simple.triangles.size(), 3100u);
  EXPECT_LT(FarthestVertex_mm(fan, simple), 1.5);
}

}  // namespace
}  // namespace semblance::problems
