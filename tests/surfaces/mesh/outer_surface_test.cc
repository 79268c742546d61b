// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/outer_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "surfaces/base/error.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using testing::Joined;
using testing::Plate;
using testing::SphereMesh;

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

}  // namespace
}  // namespace semblance
