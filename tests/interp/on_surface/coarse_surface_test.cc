// SPDX-License-Identifier: GPL-3.0-or-later
// Coarser surfaces, and the relief of a surface.
#include "interp/on_surface/coarse_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "interp/on_surface/bone_geometry.h"
#include "tests/testing/shapes.h"

namespace semblance::interp {
namespace {

using testing::Joined;
using testing::Plate;
using testing::SphereMesh;

double TotalArea(const TriMesh& mesh) {
  const std::vector<double> areas = VertexAreas(mesh);
  return std::accumulate(areas.begin(), areas.end(), 0.0);
}

Vec3 PointAt(const TriMesh& mesh, const CornerWeights& at) {
  return at.weights[0] * mesh.points[at.corners[0]] + at.weights[1] * mesh.points[at.corners[1]] +
         at.weights[2] * mesh.points[at.corners[2]];
}

TEST(CoarseSurface, IsTheSkullItselfWhereItsEdgesAreLonger) {
  const TriMesh plate = Plate(40, 10);
  for (const double edge_mm : {0.0, 3.9}) {
    const CoarseSurface coarse(plate, edge_mm, {});
    EXPECT_EQ(coarse.mesh().points, plate.points);
    EXPECT_EQ(coarse.mesh().triangles.size(), plate.triangles.size());
  }
}

TEST(CoarseSurface, OfASphereIsAClosedSphereWithFewerVertices) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 60, 120);
  const CoarseSurface coarse(sphere, 6, {});
  const TriMesh& mesh = coarse.mesh();
  EXPECT_LT(mesh.points.size(), sphere.points.size() / 10);
  EXPECT_EQ(mesh.triangles.size(), 2 * mesh.points.size() - 4);  // Euler, and no border
  EXPECT_NEAR(TotalArea(mesh), TotalArea(sphere), 0.01 * TotalArea(sphere));
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      ASSERT_GT((mesh.points[i] - mesh.points[j]).norm(), 4);  // 6 along edges
    }
  }
  for (std::size_t v = 0; v < sphere.points.size(); ++v) {
    const CornerWeights at = coarse.Locate(sphere.points[v], static_cast<int>(v));
    ASSERT_NEAR(at.weights.sum(), 1, 1e-12);
    ASSERT_GE(at.weights.minCoeff(), -1e-12);
    ASSERT_LT((PointAt(mesh, at) - sphere.points[v]).norm(), 1);
  }
}

TEST(CoarseSurface, KeepsTwoSidesOfAThinWallApart) {
  TriMesh back = Plate(40, 40);
  for (Vec3& p : back.points) {
    p.z() = -0.5;
  }
  const CoarseSurface coarse(Joined(Plate(40, 40), back), 5, {});
  for (const Triangle& t : coarse.mesh().triangles) {
    ASSERT_EQ(coarse.mesh().points[t[0]].z(), coarse.mesh().points[t[1]].z());
    ASSERT_EQ(coarse.mesh().points[t[0]].z(), coarse.mesh().points[t[2]].z());
  }
  const CornerWeights at = coarse.Locate({20, 20, -0.4}, 41 * 20 + 20);  // of the front
  EXPECT_EQ(PointAt(coarse.mesh(), at).z(), 0);
}

TEST(CoarseSurface, HasAVertexForAPieceWithoutATriangle) {
  TriMesh mesh = Plate(40, 40);
  mesh.points.emplace_back(0, 0, 90);
  const CoarseSurface coarse(mesh, 5, {});
  const CornerWeights at = coarse.Locate({0, 0, 90}, static_cast<int>(mesh.points.size()) - 1);
  EXPECT_EQ(PointAt(coarse.mesh(), at), Vec3(0, 0, 90));
}

// (1 - r^2 Laplace) x = x (1 + 2 r^2 / R^2) on a sphere, so that the smoothed sphere is smaller.
TEST(BoneRelief, OfASphereIsItsShrinking) {
  const double radius = 50;
  const Eigen::MatrixXd relief =
      BoneRelief(SphereMesh({3, 4, 5}, radius, 60), std::vector<double>{10.0, 40.0});
  for (int k = 0; k < 2; ++k) {
    const double scale = k == 0 ? 10 : 40;
    const double exact = radius / (1 + 2 * scale * scale / (radius * radius)) - radius;
    EXPECT_NEAR(relief.row(k).maxCoeff(), exact, 0.02 * radius);
    EXPECT_NEAR(relief.row(k).minCoeff(), exact, 0.02 * radius);
  }
}

TEST(BoneRelief, IsAboveZeroInAHollow) {
  TriMesh plate = Plate(100, 50);
  for (Vec3& p : plate.points) {
    p.z() = -5 * std::exp(-(p - Vec3(50, 50, 0)).squaredNorm() / 200);
  }
  const Eigen::MatrixXd relief = BoneRelief(plate, std::vector<double>{10.0});
  const auto middle = 51 * 25 + 25;
  EXPECT_GT(relief(0, middle), 1);
  EXPECT_EQ(relief.row(0).maxCoeff(), relief(0, middle));
}

}  // namespace
}  // namespace semblance::interp
