// SPDX-License-Identifier: GPL-3.0-or-later
// Distances along the surface, and the schemes that can use them.
#include "interp/on_surface/surface_distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "interp/interpolate_depth.h"
#include "surfaces/base/error.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::Count;
using testing::DowelScene;
using testing::FlatScene;
using testing::Plate;
using testing::SphereMesh;

TEST(SurfaceDistance, IsTheStraightLineOnAPlane) {
  const TriMesh plate = Plate(40, 20);
  for (const Vec3& source : {Vec3(20, 20, 0), Vec3(3.3, 11.7, 0), Vec3(0, 0, 5)}) {
    const Vec3 foot(source.x(), source.y(), 0);
    const std::vector<double> distance = SurfaceDistance(plate).From(source);
    for (std::size_t i = 0; i < distance.size(); ++i) {
      const double straight = (plate.points[i] - foot).norm();
      ASSERT_NEAR(distance[i], straight, 0.3 + 0.01 * straight);
      ASSERT_GE(distance[i], straight - 1e-9);
    }
  }
}

TEST(SurfaceDistance, IsTheArcOnASphere) {
  const TriMesh sphere = SphereMesh({1, 2, 3}, 90, 60);
  const Vec3 source = sphere.points[1000];
  const std::vector<double> distance = SurfaceDistance(sphere).From(source);
  for (std::size_t i = 0; i < distance.size(); ++i) {
    const Vec3 a = (source - Vec3(1, 2, 3)) / 90, b = (sphere.points[i] - Vec3(1, 2, 3)) / 90;
    const double arc = 90 * std::atan2(a.cross(b).norm(), a.dot(b));
    ASSERT_NEAR(distance[i], arc, 0.1 + 0.02 * arc);
  }
}

TEST(SurfaceDistance, GoesAroundAndNotAcross) {
  // Two plates side by side, 1 mm apart, joined by nothing.
  TriMesh mesh = Plate(40, 10);
  const TriMesh other = mesh;
  const int n = static_cast<int>(mesh.points.size());
  for (const Vec3& p : other.points) {
    mesh.points.push_back(p + Vec3(0, 0, -1));
  }
  for (const Triangle& t : other.triangles) {
    mesh.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  }
  std::vector<double> distance = SurfaceDistance(mesh).From({5, 5, 0.1});
  for (int i = 0; i < n; ++i) {
    ASSERT_TRUE(std::isfinite(distance[i]));
    ASSERT_TRUE(std::isinf(distance[n + i]));
  }
  // Joined along x = 40.
  for (int j = 0; j < 10; ++j) {
    const int a = 10 + 11 * j, b = a + 11;
    mesh.triangles.push_back({a, n + a, b});
    mesh.triangles.push_back({b, n + a, n + b});
  }
  distance = SurfaceDistance(mesh).From({0, 20, 0.1});
  EXPECT_NEAR(distance[n + 5 * 11], 81, 0.1);
}

TEST(SurfaceDistance, StaysFiniteOnSliversAndPointTriangles) {
  TriMesh mesh = Plate(10, 5);
  mesh.points[7] = mesh.points[8];
  mesh.points[15] = mesh.points[14] + Vec3(1e-9, 0, 0);
  mesh.triangles.push_back({3, 3, 9});
  const std::vector<double> distance = SurfaceDistance(mesh).From({9, 9, 0});
  for (std::size_t i = 0; i < distance.size(); ++i) {
    EXPECT_GE(distance[i], (mesh.points[i] - Vec3(9, 9, 0)).norm() - 1e-6);
    EXPECT_LE(distance[i], 20);
  }
}

// A dowel on each of two plates that lie back to back without touching.
DowelScene BackToBack() {
  DowelScene scene = FlatScene();
  const TriMesh one = scene.skull;
  const int n = static_cast<int>(one.points.size());
  for (const Vec3& p : one.points) {
    scene.skull.points.push_back(p + Vec3(0, 0, -1));
    scene.normals.emplace_back(0, 0, 1);
  }
  for (const Triangle& t : one.triangles) {
    scene.skull.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  }
  scene.network.areas.clear();
  scene.dowels = {{"g", {10, 10, 0}, {0, 0, 1}, 4, 1}, {"n", {30, 30, -1}, {0, 0, 1}, 9, 2}};
  return scene;
}

TEST(GeodesicSchemes, KeepADowelsDepthOnItsOwnBone) {
  const DowelScene scene = BackToBack();
  const DowelDistance along = DowelDistance::kGeodesic;
  for (const DepthScheme& scheme :
       {DepthScheme{Nearest{.distance = along}}, DepthScheme{InverseDistance{.distance = along}}}) {
    const DepthField field = InterpolateDepth(scheme, scene.Input(), RunContext{});
    for (int i = 0; i < 882; ++i) {
      ASSERT_NEAR(field.depth_mm[i], i < 441 ? 4 : 9, 1e-12);
    }
    EXPECT_NEAR(field.sd_mm[881], 2, 1e-12);
    EXPECT_TRUE(NeedsSurface(scheme));
  }
  EXPECT_FALSE(NeedsSurface(Nearest{}));
}

TEST(GeodesicSchemes, LeavePiecesWithoutADowel) {
  DowelScene scene = BackToBack();
  scene.dowels.pop_back();
  const DowelDistance along = DowelDistance::kGeodesic;
  for (const DepthScheme& scheme :
       {DepthScheme{Nearest{.distance = along}}, DepthScheme{InverseDistance{.distance = along}},
        DepthScheme{Kriging{.distance = along}}}) {
    const DepthField field = InterpolateDepth(scheme, scene.Input(), RunContext{});
    EXPECT_EQ(Count(field, DepthStatus::kAssigned), 441);
    EXPECT_EQ(Count(field, DepthStatus::kOutside), 441);
    EXPECT_TRUE(std::isnan(field.depth_mm[881]));
  }
}

TEST(GeodesicSchemes, KrigingInterpolatesCertainDowelsAlongTheBone) {
  DowelScene scene = BackToBack();
  scene.dowels.push_back({"po", {10, 30, 0}, {0, 0, 1}, 7, kNaN});
  const Kriging certain{.distance = DowelDistance::kGeodesic, .nugget_share = 0};
  const DepthField field = InterpolateDepth(certain, scene.Input(), RunContext{});
  for (const Dowel& dowel : scene.dowels) {
    const auto at = std::ranges::find(scene.skull.points, dowel.base) - scene.skull.points.begin();
    ASSERT_LT(at, 882);
    EXPECT_NEAR(field.depth_mm[at], dowel.depth_mm, 1e-6) << dowel.site;
    EXPECT_NEAR(field.sd_mm[at], 0, 0.1) << dowel.site;
  }
}

TEST(GeodesicSchemes, OnAPlaneAreTheStraightOnes) {
  const DowelScene scene = FlatScene();
  const DowelDistance along = DowelDistance::kGeodesic;
  for (const auto& [straight, geodesic] :
       {std::pair{DepthScheme{InverseDistance{}}, DepthScheme{InverseDistance{.distance = along}}},
        std::pair{DepthScheme{Kriging{}}, DepthScheme{Kriging{.distance = along}}}}) {
    const DepthField one = InterpolateDepth(straight, scene.Input(), RunContext{});
    const DepthField other = InterpolateDepth(geodesic, scene.Input(), RunContext{});
    for (std::size_t i = 0; i < one.depth_mm.size(); ++i) {
      ASSERT_NEAR(one.depth_mm[i], other.depth_mm[i], 0.05);
    }
  }
}

TEST(GeodesicSchemes, ReportThatTheyNeedTriangles) {
  const DowelScene scene = FlatScene().At({{1, 2, 3}});
  try {
    InterpolateDepth(Nearest{.distance = DowelDistance::kGeodesic}, scene.Input(), RunContext{});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), ::testing::StartsWith("nearest: the skull has 1 vertices and no "));
  }
}

}  // namespace
}  // namespace semblance::interp
