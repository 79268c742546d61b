// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/plane_section.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::Plate;
using testing::SphereMesh;

Vec3 RandomDirection(Random& random) {
  return Vec3(random.Normal(), random.Normal(), random.Normal()).normalized();
}

PicturePlane RandomPlane(Random& random, double reach_mm) {
  const Vec3 normal = RandomDirection(random);
  const Vec3 right = normal.unitOrthogonal();
  return {.origin = (2 * random.Uniform() - 1) * reach_mm * normal,
          .right = right,
          .up = normal.cross(right)};
}

PicturePlane Level(double z_mm) {
  return {.origin = {0, 0, z_mm}, .right = Vec3::UnitX(), .up = Vec3::UnitY()};
}

// By the divergence theorem.
double Volume(const TriMesh& mesh) {
  double volume = 0;
  for (const Triangle& t : mesh.triangles) {
    volume += mesh.points[t[0]].dot(mesh.points[t[1]].cross(mesh.points[t[2]])) / 6;
  }
  return volume;
}

// A sphere with a hollow: the inner wall faces inwards.
TriMesh HollowSphere() {
  TriMesh mesh = SphereMesh({0, 0, 0}, 40, 24), inner = SphereMesh({3, -2, 5}, 20, 16);
  const auto shift = static_cast<std::int32_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), inner.points.begin(), inner.points.end());
  for (const Triangle& t : inner.triangles) {
    mesh.triangles.push_back({t[0] + shift, t[2] + shift, t[1] + shift});
  }
  return mesh;
}

TEST(PlaneSection, ASphereIsCutInCirclesOfTheClosedForm) {
  const double radius_mm = 50;
  const TriMesh sphere = SphereMesh({0, 0, 0}, radius_mm, 200);
  Random random(4);
  for (int k = 0; k < 40; ++k) {
    const PicturePlane plane = RandomPlane(random, 0.9 * radius_mm);
    const double height_mm = plane.Height_mm(Vec3::Zero());
    const double expected = std::numbers::pi * (radius_mm * radius_mm - height_mm * height_mm);
    const auto lines = CutByPlane(sphere, plane);
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_TRUE(lines[0].closed);
    EXPECT_NEAR(EnclosedArea(lines), expected, 1e-3 * expected);
  }
}

TEST(PlaneSection, AreasIntegrateToTheVolume) {
  const TriMesh mesh = HollowSphere();
  std::vector<double> heights_mm;
  for (const Vec3& p : mesh.points) {
    heights_mm.push_back(p.z());
  }
  std::ranges::sort(heights_mm);
  const auto area = [&](double z_mm) { return EnclosedArea(CutByPlane(mesh, Level(z_mm))); };
  // Between two heights of vertices the area is a quadratic function, which Gauss's two points
  // integrate exactly.
  double volume = 0;
  for (std::size_t k = 1; k < heights_mm.size(); ++k) {
    const double half = (heights_mm[k] - heights_mm[k - 1]) / 2;
    const double middle = (heights_mm[k] + heights_mm[k - 1]) / 2;
    volume +=
        half < 1e-9
            ? 0
            : half * (area(middle - half / std::sqrt(3)) + area(middle + half / std::sqrt(3)));
  }
  EXPECT_NEAR(volume, Volume(mesh), 1e-6 * Volume(mesh));
}

TEST(PlaneSection, AHollowIsTakenOut) {
  const auto lines = CutByPlane(HollowSphere(), Level(5));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_GT(EnclosedArea({&lines[0], 1}), 0);
  EXPECT_LT(EnclosedArea({&lines[1], 1}), 0);
  EXPECT_NEAR(EnclosedArea(lines), std::numbers::pi * (1600 - 25 - 400), 60);
}

TEST(PlaneSection, PlanesThroughVerticesGiveClosedLinesToo) {
  const TriMesh mesh = HollowSphere();
  for (const Vec3& through : mesh.points) {
    for (const SectionLine& line : CutByPlane(mesh, Level(through.z()))) {
      ASSERT_TRUE(line.closed);
      ASSERT_GE(line.points.size(), 3u);
    }
  }
}

TEST(PlaneSection, PointsLieOnEdgesOfTheMesh) {
  const TriMesh mesh = HollowSphere();
  Random random(9);
  for (int k = 0; k < 5; ++k) {
    const PicturePlane plane = RandomPlane(random, 30);
    for (const SectionLine& line : CutByPlane(mesh, plane)) {
      for (const Vec2& p : line.points) {
        const Vec3 point = plane.InSpace(p);
        double nearest_mm = 1;
        for (const Triangle& t : mesh.triangles) {
          for (const int c : {0, 1, 2}) {
            nearest_mm = std::min(nearest_mm, DistanceToSegment(point, mesh.points[t[c]],
                                                                mesh.points[t[(c + 1) % 3]]));
          }
        }
        EXPECT_LT(nearest_mm, 1e-9);
      }
    }
  }
}

TEST(PlaneSection, ABorderGivesAnOpenLineFromEndToEnd) {
  const TriMesh plate = Plate(10, 7);
  const auto lines =
      CutByPlane(plate, {.origin = {0, 3.1, 0}, .right = Vec3::UnitX(), .up = Vec3::UnitZ()});
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_FALSE(lines[0].closed);
  EXPECT_NEAR(std::abs(lines[0].points.front().x() - lines[0].points.back().x()), 10, 1e-12);
  EXPECT_EQ(EnclosedArea(lines), 0);
}

TEST(PlaneSection, APlaneBesideTheMeshCutsNothing) {
  EXPECT_TRUE(CutByPlane(SphereMesh({0, 0, 0}, 10, 8), Level(10.5)).empty());
}

}  // namespace
}  // namespace semblance::surfaces
