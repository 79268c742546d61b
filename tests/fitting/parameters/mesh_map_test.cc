// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/mesh_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "fitting/folds/fold_check.h"
#include "surfaces/base/error.h"
#include "tests/testing/shapes.h"

namespace semblance::fitting {
namespace {

using ::testing::HasSubstr;

constexpr MeshMap kMaps[] = {MeshMap::kArap, MeshMap::kLscm, MeshMap::kMeanValue, MeshMap::kTutte};

// More than a half sphere: it folds over every plane.
Vec3 Bowl(const Vec2& uv) {
  const Vec2 q = 2 * uv - Vec2(1, 1);
  const double t = 1.9 * std::max(std::abs(q.x()), std::abs(q.y())), p = std::atan2(q.y(), q.x());
  return 50 * Vec3(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t));
}

// A third of a pipe, turned in space.
Vec3 Pipe(const Vec2& uv) {
  static const Mat3 turn = Eigen::AngleAxisd(0.8, Vec3(1, -2, 0.5).normalized()).matrix();
  return turn * Vec3(30 * std::sin(2 * uv.x()), 80 * uv.y(), 30 * std::cos(2 * uv.x()));
}

TEST(MeshMap, EveryMapIsOneToOneCounterClockwiseAndKeepsTheArea) {
  const TriMesh mesh = testing::GridMesh(Bowl, 24);
  for (const MeshMap map : kMaps) {
    const MeshLayout layout = LayOut(mesh, map);
    ASSERT_EQ(layout.at.size(), mesh.points.size());
    const MapFaults faults = FaultsOfTriangles({mesh.points, layout.at}, mesh.triangles);
    EXPECT_EQ(faults.folded, 0) << static_cast<int>(map);
    EXPECT_FALSE(faults.mirrored) << static_cast<int>(map);
    double area = 0;
    for (const Triangle& t : mesh.triangles) {
      const Vec2 a = layout.at[t[1]] - layout.at[t[0]], b = layout.at[t[2]] - layout.at[t[0]];
      area += (a.x() * b.y() - a.y() * b.x()) / 2;
    }
    EXPECT_NEAR(area, Area(mesh), 1e-6 * Area(mesh)) << static_cast<int>(map);
    EXPECT_EQ(layout.map, map);
  }
}

// A pipe is unrolled: every edge keeps its length.
TEST(MeshMap, FreeBordersUnrollAPipe) {
  const TriMesh mesh = testing::GridMesh(Pipe, 16);
  for (const MeshMap map : {MeshMap::kArap, MeshMap::kLscm}) {
    const MeshLayout layout = LayOut(mesh, map);
    for (const Triangle& t : mesh.triangles) {
      for (int k = 0; k < 3; ++k) {
        const double length = (mesh.points[t[k]] - mesh.points[t[(k + 1) % 3]]).norm();
        EXPECT_NEAR((layout.at[t[k]] - layout.at[t[(k + 1) % 3]]).norm(), length, 1e-3 * length);
      }
    }
  }
}

// The corners of the mesh become those of the square.
TEST(MeshMap, ASquareTakesTheCornersOfARectangle) {
  const TriMesh mesh =
      testing::GridMesh([](const Vec2& uv) { return Vec3(90 * uv.x(), 20 * uv.y(), 7); }, 12);
  for (const MeshMap map : {MeshMap::kMeanValue, MeshMap::kTutte}) {
    const MeshLayout layout = LayOut(mesh, map);
    Eigen::AlignedBox2d box;
    for (const Vec2& p : layout.at) {
      box.extend(p);
    }
    EXPECT_NEAR(box.sizes().x(), box.sizes().y(), 1e-9 * box.sizes().x());
    for (const int corner : {0, 12, 13 * 12, 13 * 13 - 1}) {
      const Vec2 place = (layout.at[corner] - box.min()).cwiseQuotient(box.sizes());
      EXPECT_NEAR((place - Vec2(place.x() > 0.5, place.y() > 0.5)).norm(), 0, 1e-9) << corner;
    }
  }
}

TEST(MeshMap, AHoleIsBridgedAndNoPointIsAdded) {
  TriMesh mesh = testing::GridMesh(Bowl, 24);
  const int middle = 12 * 24 + 11;
  mesh.triangles.erase(mesh.triangles.begin() + 2 * middle,
                       mesh.triangles.begin() + 2 * middle + 4);
  const MeshLayout layout = LayOut(mesh, MeshMap::kAuto);
  EXPECT_EQ(layout.at.size(), mesh.points.size());
  EXPECT_EQ(FaultsOfTriangles({mesh.points, layout.at}, mesh.triangles).folded, 0);
}

TEST(MeshMap, AMeshThatIsNoDiscIsRefusedWithTheRemedy) {
  const auto message = [](const TriMesh& mesh) -> std::string {
    try {
      LayOut(mesh, MeshMap::kAuto);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  const TriMesh plate = testing::Plate(10, 4), sphere = testing::SphereMesh({0, 0, 50}, 10, 8);
  EXPECT_THAT(message(sphere), HasSubstr("it is closed"));
  EXPECT_THAT(message(sphere), HasSubstr("give the columns u and v"));
  EXPECT_THAT(message(testing::Joined(plate, sphere)), HasSubstr("2 pieces"));
  TriMesh loose = plate;
  loose.points.emplace_back(1, 2, 3);
  EXPECT_THAT(message(loose), HasSubstr("1 of its"));
  TriMesh fin = plate;
  fin.points.emplace_back(0, 0, 9);
  const Triangle first = fin.triangles.front();
  fin.triangles.push_back({first[0], first[1], static_cast<std::int32_t>(fin.points.size()) - 1});
  fin.triangles.push_back({first[1], first[2], static_cast<std::int32_t>(fin.points.size()) - 1});
  fin.triangles.push_back({first[2], first[0], static_cast<std::int32_t>(fin.points.size()) - 1});
  EXPECT_THAT(message(fin), HasSubstr("manifold"));
}

// A torus with a triangle missing has a border, and a handle.
TEST(MeshMap, AHandleIsCounted) {
  TriMesh torus = testing::RingMesh(12);
  torus.triangles.pop_back();
  try {
    LayOut(torus, MeshMap::kAuto);
    FAIL() << "no error";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("1 handles"));
  }
}

}  // namespace
}  // namespace semblance::fitting
