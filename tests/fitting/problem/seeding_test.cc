// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/seeding.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "surfaces/base/error.h"
#include "tests/testing/shapes.h"

namespace semblance::fitting {
namespace {

using ::testing::HasSubstr;

// A part of a sphere about the origin, with longitude along u and latitude along v; normals point
// outwards.
HSplineSurface Cap(double radius_mm) {
  const HSplineShape shape{.patches_u = 6, .patches_v = 5, .max_level = 3};
  ControlNet net{.columns = shape.Columns(0), .rows = shape.Rows(0), .vertices = {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const double lon = -1.2 + 2.4 * (i - 1.0) / 6, lat = -0.9 + 1.8 * (j - 1.0) / 5;
      net.vertices.push_back(radius_mm * Vec3(std::cos(lat) * std::cos(lon),
                                              std::cos(lat) * std::sin(lon), std::sin(lat)));
    }
  }
  return HSplineSurface(shape, net);
}

const TriMesh& Sphere75() {
  static const TriMesh mesh = testing::SphereMesh(Vec3::Zero(), 75, 60);
  return mesh;
}

SeedResult SeedCap(const HSplineSurface& cap, const SeedOptions& options,
                   const std::vector<Sphere>& masks = {}) {
  return SeedDowels(cap, MeshQuery(Sphere75()), Sphere75(), masks, options);
}

TEST(Seeding, FindsTheSphereFromInsideAndOutside) {
  for (const double radius_mm : {62.0, 90.0}) {
    const HSplineSurface cap = Cap(radius_mm);
    for (const SeedMethod method : {SeedMethod::kRay, SeedMethod::kClosest}) {
      const SeedResult result = SeedCap(cap, {.method = method, .level = 1});
      ASSERT_EQ(result.points.size(), 12u * 10u);
      EXPECT_EQ(result.masked, 0);
      EXPECT_EQ(result.missed, 0);
      EXPECT_EQ(result.folded, 0);
      EXPECT_EQ(result.points[0].label, "seed_0_0");
      EXPECT_EQ(result.points[13].label, "seed_1_1");
      for (const FitPoint& p : result.points) {
        EXPECT_NEAR(p.position.norm(), 75, 0.2);
        EXPECT_LT(p.position.normalized().cross(cap.Point(p.uv).normalized()).norm(), 0.03);
        EXPECT_GT(p.position.dot(cap.Point(p.uv)), 0);
        EXPECT_EQ(p.role, PointRole::kSeed);
      }
      EXPECT_LT((result.points[13].uv - Vec2(1.5 / 12, 1.5 / 10)).norm(), 1e-15);
    }
  }
}

TEST(Seeding, NoSeedLiesInAMaskAndOthersDoNotMove) {
  const HSplineSurface cap = Cap(62);
  const std::vector<Sphere> masks = {{.center = Vec3(75, 0, 0), .radius_mm = 20},
                                     {.center = Vec3(50, 50, 0), .radius_mm = 15}};
  const SeedResult all = SeedCap(cap, {}), some = SeedCap(cap, {}, masks);
  EXPECT_GT(some.masked, 10);
  EXPECT_EQ(some.masked + some.points.size(), all.points.size());
  std::size_t k = 0;
  for (const FitPoint& p : some.points) {
    EXPECT_FALSE(masks[0].Contains(p.position) || masks[1].Contains(p.position));
    while (all.points[k].label != p.label) {
      ++k;
    }
    EXPECT_EQ(all.points[k].position, p.position);
  }
}

TEST(Seeding, PointsTooFarOrFacingAwayAreMissed) {
  const HSplineSurface cap = Cap(62);
  const SeedResult far = SeedCap(cap, {.level = 1, .max_distance_mm = 8});
  EXPECT_TRUE(far.points.empty());
  EXPECT_EQ(far.missed, 120);
  TriMesh inside_out = Sphere75();
  for (Triangle& t : inside_out.triangles) {
    std::swap(t[1], t[2]);
  }
  const SeedResult away = SeedDowels(cap, MeshQuery(inside_out), inside_out, {}, {.level = 1});
  EXPECT_EQ(away.missed, 120);
}

// A ray never takes the far side of the face, even if it is nearer.
TEST(Seeding, TakesTheNearestTriangleThatFacesAlongTheRay) {
  TriMesh mesh = testing::Plate(200, 4);
  TriMesh below = mesh;
  for (Vec3& p : mesh.points) {
    p += Vec3(-100, -100, 12);
  }
  for (Vec3& p : below.points) {
    p += Vec3(-100, -100, 3);
  }
  for (Triangle t : below.triangles) {
    std::swap(t[0], t[1]);  // faces down
    for (auto& v : t) {
      v += static_cast<int>(mesh.points.size());
    }
    mesh.triangles.push_back(t);
  }
  mesh.points.insert(mesh.points.end(), below.points.begin(), below.points.end());
  const HSplineShape shape{.patches_u = 3, .patches_v = 3, .max_level = 2};
  ControlNet net{.columns = 6, .rows = 6, .vertices = {}};
  for (int k = 0; k < 36; ++k) {
    net.vertices.emplace_back(10.0 * (k % 6), 10.0 * (k / 6), 0);
  }
  const SeedResult result =
      SeedDowels(HSplineSurface(shape, net), MeshQuery(mesh), mesh, {}, {.level = 0});
  ASSERT_EQ(result.points.size(), 9u);
  for (const FitPoint& p : result.points) {
    EXPECT_NEAR(p.position.z(), 12, 1e-12);
  }
}

// A sheet with a narrow trough lies 18 mm under a plate. Its own normals cross before they reach
// the plate, and the seeds that change places are dropped. The smoothed normals do not cross.
TEST(Seeding, NeighboursKeepTheirPlaces) {
  TriMesh plate = testing::Plate(200, 8);
  for (Vec3& p : plate.points) {
    p += Vec3(-60, -60, 18);
  }
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 2};
  ControlNet net{.columns = 11, .rows = 11, .vertices = {}};
  for (int k = 0; k < 121; ++k) {
    net.vertices.emplace_back(10.0 * (k % 11 - 1), 10.0 * (k / 11 - 1), 0);
  }
  HSplineSurface sheet(shape, net);
  ControlNet fine = sheet.Net(2);
  for (Vec3& v : fine.vertices) {
    v.z() -= 8 * std::exp(-std::pow((v.x() - 40) / 6, 2));
  }
  sheet.SetNet(2, fine);
  const MeshQuery query(plate);
  const SeedResult smooth = SeedDowels(sheet, query, plate, {}, {});
  EXPECT_EQ(smooth.points.size(), 32u * 32u);
  EXPECT_EQ(smooth.folded, 0);
  const SeedResult own = SeedDowels(sheet, query, plate, {}, {.direction_level = 2});
  EXPECT_GE(own.folded, 32);  // in each of the 32 rows across the trough
  for (std::size_t k = 1; k < own.points.size(); ++k) {
    const FitPoint &a = own.points[k - 1], &b = own.points[k];
    const bool neighbours = a.uv.y() == b.uv.y() && b.uv.x() - a.uv.x() < 1.5 / 32;
    EXPECT_TRUE(!neighbours || b.position.x() >= a.position.x()) << b.label;
  }
}

TEST(Seeding, WrongInputIsNamed) {
  const HSplineSurface cap = Cap(62);
  const auto message = [&](const SeedOptions& options,
                           const std::vector<Sphere>& masks) -> std::string {
    try {
      SeedCap(cap, options, masks);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(message({.direction_level = 4}, {}), HasSubstr("direction_level 4"));
  EXPECT_THAT(message({.level = 9}, {}), HasSubstr("level 9"));
  EXPECT_THAT(message({.max_distance_mm = 0}, {}), HasSubstr("max_distance_mm 0"));
  EXPECT_THAT(message({}, {{.center = Vec3::Zero(), .radius_mm = -1}}), HasSubstr("mask 0"));
}

}  // namespace
}  // namespace semblance::fitting
