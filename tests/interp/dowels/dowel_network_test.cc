// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/dowel_network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "interp/interpolate_depth.h"
#include "interp/schemes/network_schemes.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::DomeScene;
using testing::DowelScene;
using ::testing::ElementsAre;
using testing::FlatScene;

std::vector<double> DepthsAt(const DepthScheme& scheme, const DowelScene& scene,
                             std::vector<Vec3> points, const Vec3& normal) {
  return InterpolateDepth(scheme, scene.At(std::move(points), normal).Input(), {}).depth_mm;
}

Insertion Insert(DowelScene& scene, const Vec3& base, const Vec3& direction, double depth_mm) {
  scene.dowels.push_back({"my_site", base, direction, depth_mm});
  return InsertIntoNetwork(scene.dowels, static_cast<int>(scene.dowels.size()) - 1, scene.network);
}

double AreaOf(const DowelScene& scene) {
  TriMesh mesh;
  for (const Dowel& dowel : scene.dowels) {
    mesh.points.push_back(dowel.base);
  }
  mesh.triangles.assign(scene.network.areas.begin(), scene.network.areas.end());
  Vec3 sum = Vec3::Zero();
  for (const Triangle& t : mesh.triangles) {
    sum += TriangleAreaVector(mesh, t);
  }
  return sum.z();
}

// On a plane the three parts of a split area interpolate like the whole area.
TEST(InsertIntoNetwork, OnAPlaneTheInterpolatedDepthChangesNothing) {
  const Vec3 up(0, 0, 1);
  for (const Vec3& base : {Vec3(20, 10, 0), Vec3(20, 20, 0), Vec3(20, 5, 0), Vec3(6, 5.5, 0)}) {
    const DowelScene before = FlatScene();
    DowelScene after = before;
    const double depth_mm = DepthsAt(Barycentric{}, before, {base}, up)[0];
    EXPECT_EQ(Insert(after, base, up, depth_mm), Insertion::kInside);
    EXPECT_NEAR(AreaOf(after), AreaOf(before), 1e-9);
    const std::vector<double> was = InterpolateDepth(Barycentric{}, before.Input(), {}).depth_mm,
                              is = InterpolateDepth(Barycentric{}, after.Input(), {}).depth_mm;
    for (std::size_t v = 0; v < was.size(); ++v) {
      EXPECT_TRUE(std::isnan(was[v]) ? std::isnan(is[v]) : std::abs(was[v] - is[v]) < 1e-9)
          << was[v] << " " << is[v];
    }
  }
}

TEST(InsertIntoNetwork, AnEdgeIsSplitOnBothSides) {
  DowelScene scene = FlatScene();
  EXPECT_EQ(Insert(scene, {20, 20, 0}, {0, 0, 1}, 5), Insertion::kInside);
  EXPECT_EQ(scene.network.areas.size(), 4u);  // the diagonal belongs to both areas
  EXPECT_EQ(Insert(scene, {20, 5, 0}, {0, 0, 1}, 5), Insertion::kInside);
  EXPECT_EQ(scene.network.areas.size(), 5u);  // a side belongs to one area
}

TEST(InsertIntoNetwork, OutsideTheNearestEdgeGetsAnArea) {
  DowelScene scene = FlatScene();
  const double before = AreaOf(scene);
  EXPECT_EQ(Insert(scene, {20, -5, 0}, {0, 0, 1}, 11), Insertion::kOutside);
  EXPECT_EQ(scene.network.areas.back(), (std::array{1, 0, 4}));
  EXPECT_NEAR(AreaOf(scene), before + 30 * 10 / 2.0, 1e-9);
  const std::vector<double> depth =
      DepthsAt(Barycentric{}, scene, {{20, -5, 0}, {20, 10, 0}}, {0, 0, 1});
  EXPECT_NEAR(depth[0], 11, 1e-9);
  EXPECT_EQ(depth[1], DepthsAt(Barycentric{}, FlatScene(), {{20, 10, 0}}, {0, 0, 1})[0]);
}

// A law for interpolating schemes: the inserted dowel's base gets its depth, and the depths at all
// other bases stay.
TEST(InsertIntoNetwork, ADowelsOwnDepthHoldsAtItsBaseAndNoOtherChanges) {
  const DepthScheme schemes[] = {Barycentric{}, Nearest{},          InverseDistance{},
                                 RadialBasis{}, NaturalNeighbour{}, NetworkSpline{}};
  for (const DepthScheme& scheme : schemes) {
    for (const Vec3& toward : {Vec3(10, -80, 35), Vec3(30, -80, 55), Vec3(0, -80, 30)}) {
      DowelScene scene = DomeScene();
      const Vec3 base = 90 * toward.normalized();
      EXPECT_NE(Insert(scene, base, base / 90, 9.5), Insertion::kNone);
      std::vector<Vec3> bases;
      for (const Dowel& dowel : scene.dowels) {
        bases.push_back(dowel.base);
      }
      const std::vector<double> depth = DepthsAt(scheme, scene, bases, {0, -1, 0});
      for (std::size_t k = 0; k < depth.size(); ++k) {
        EXPECT_NEAR(depth[k], scene.dowels[k].depth_mm, 1e-6)
            << scheme.index() << " " << scene.dowels[k].site;
      }
    }
  }
}

TEST(InsertIntoNetwork, OnAnotherBaseNothingIsInserted) {
  DowelScene scene = DomeScene();
  const std::vector<std::array<int, 3>> areas = scene.network.areas;
  EXPECT_EQ(Insert(scene, scene.dowels[3].base, {0, -1, 0}, 5), Insertion::kNone);
  EXPECT_EQ(scene.network.areas, areas);
}

// The four dowels of FlatScene with a fifth in their middle, and four areas around it.
DowelScene CrossScene() {
  DowelScene scene = FlatScene();
  scene.dowels.push_back({"zz", {20, 20, 0}, Vec3(0, 0, 1), 12, 1});
  scene.network.areas = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  return scene;
}

TEST(LeftOutDowels, InsideTheNetworkLeaveNoGap) {
  const DowelScene scene = CrossScene();
  const ShownDowels shown = LeaveOutDowels(scene.dowels, scene.network, {4});
  EXPECT_EQ(shown.dowels.size(), 4u);
  ASSERT_EQ(shown.network.areas.size(), 2u);
  // On the fan's diagonal the depth is the mean of its two ends, as if the dowel had never existed.
  const DowelScene asked = scene.At({{20, 20, 0}, {12, 20, 0}, {20, 29, 0}});
  const DepthField field = InterpolateDepth(
      Barycentric{}, {asked.skull, asked.normals, shown.dowels, shown.network}, {});
  for (const DepthStatus status : field.status) {
    EXPECT_EQ(status, DepthStatus::kAssigned);
  }
  EXPECT_TRUE(std::abs(field.depth_mm[0] - 6) < 1e-9 || std::abs(field.depth_mm[0] - 6.5) < 1e-9);
}

TEST(LeftOutDowels, AreClosedWhicheverWayTheAreasTurn) {
  DowelScene scene = CrossScene();
  for (auto& [a, b, c] : scene.network.areas) {
    std::swap(a, b);
  }
  EXPECT_EQ(LeaveOutDowels(scene.dowels, scene.network, {4}).network.areas.size(), 2u);
}

TEST(LeftOutDowels, AtTheBorderLoseTheirAreas) {
  const DowelScene scene = CrossScene();
  const ShownDowels shown = LeaveOutDowels(scene.dowels, scene.network, {0});
  EXPECT_THAT(shown.network.areas, ElementsAre(ElementsAre(0, 1, 3), ElementsAre(1, 2, 3)));
  EXPECT_TRUE(LeaveOutDowels(scene.dowels, scene.network, {0, 2}).network.areas.empty());
}

TEST(LeftOutDowels, TheNearestIsTheNearestOfThoseShown) {
  const DowelScene scene = FlatScene();
  EXPECT_EQ(LeaveOutDowels(scene.dowels, scene.network, {0}).NearestTo_mm({5, 5, 0}), 30);
  EXPECT_EQ(LeaveOutDowels(scene.dowels, scene.network, {}).NearestTo_mm({5, 5, 0}), 0);
}

}  // namespace
}  // namespace semblance::interp
