// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/left_out_dowels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "interp/schemes/network_schemes.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance {
namespace {

using testing::DowelScene;
using ::testing::ElementsAre;
using testing::FlatScene;

// The four dowels of FlatScene with a fifth in their middle, and four areas around it.
DowelScene CrossScene() {
  DowelScene scene = FlatScene();
  scene.dowels.push_back({"zz", {20, 20, 0}, Vec3(0, 0, 1), 12, 1});
  scene.network.areas = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  return scene;
}

TEST(LeftOutDowels, InsideTheNetworkLeaveNoGap) {
  const DowelScene scene = CrossScene();
  const ShownDowels shown = LeaveOutDowels(scene.Input(), {4});
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
  EXPECT_EQ(LeaveOutDowels(scene.Input(), {4}).network.areas.size(), 2u);
}

TEST(LeftOutDowels, AtTheBorderLoseTheirAreas) {
  const DowelScene scene = CrossScene();
  const ShownDowels shown = LeaveOutDowels(scene.Input(), {0});
  EXPECT_THAT(shown.network.areas, ElementsAre(ElementsAre(0, 1, 3), ElementsAre(1, 2, 3)));
  EXPECT_TRUE(LeaveOutDowels(scene.Input(), {0, 2}).network.areas.empty());
}

TEST(LeftOutDowels, TheNearestIsTheNearestOfThoseShown) {
  const DowelScene scene = FlatScene();
  EXPECT_EQ(LeaveOutDowels(scene.Input(), {0}).NearestTo_mm({5, 5, 0}), 30);
  EXPECT_EQ(LeaveOutDowels(scene.Input(), {}).NearestTo_mm({5, 5, 0}), 0);
}

}  // namespace
}  // namespace semblance
