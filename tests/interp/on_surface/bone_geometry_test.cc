// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/bone_geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <string>

#include "surfaces/base/error.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::Plate;

Dowel At(const std::string& site, const Vec3& base, const Vec3& direction) {
  return {site, base, direction, 5, kNaN};
}

// A head that faces -y with its left at +x, rotated arbitrarily.
std::vector<Dowel> Head(const Mat3& turn) {
  const Vec3 front(0, -1, 0), left_front = Vec3(1, -1, 0).normalized(),
                              right_front = Vec3(-1, -1, 0).normalized();
  std::vector<Dowel> dowels = {
      At("mso_l", {30, 0, 12}, front),       At("mio_l", {34, 0, -28}, front),
      At("mso_r", {-30, 0, 12}, front),      At("mio_r", {-34, 0, -28}, front),
      At("go_l", {50, 60, -80}, left_front), At("go_r", {-50, 60, -80}, right_front),
      At("g", {0, -10, 20}, front)};
  for (Dowel& dowel : dowels) {
    dowel.base = turn * dowel.base;
    dowel.direction = turn * dowel.direction;
  }
  return dowels;
}

TEST(FindHeadFrame, TurnsWithTheHead) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const HeadFrame frame = FindHeadFrame(Head(turn));
  EXPECT_TRUE(frame.left.isApprox(turn * Vec3(1, 0, 0), 1e-12));
  EXPECT_TRUE(frame.front.isApprox(turn * Vec3(0, -1, 0), 1e-12));
  EXPECT_TRUE(frame.up.isApprox(turn * Vec3(0, 0, 1), 1e-12));
  ASSERT_EQ(frame.orbits.size(), 2);
  EXPECT_TRUE(frame.orbits[0].isApprox(turn * Vec3(32, 0, -8), 1e-12));
}

// As in a cross-validation that leaves out a side or the orbits.
TEST(FindHeadFrame, CanBeComputedFromOneSideAndTheMidline) {
  std::vector<Dowel> dowels = Head(Mat3::Identity());
  std::erase_if(dowels, [](const Dowel& dowel) { return dowel.site.ends_with("_r"); });
  EXPECT_THAT([&] { FindHeadFrame(dowels); },
              ::testing::ThrowsMessage<InputError>(::testing::HasSubstr("three in the midline")));
  dowels.push_back(At("n", {0, -9, 0}, {0, -1, 0}));
  dowels.push_back(At("pg", {0, -4, -112}, {0, -1, 0}));
  const HeadFrame frame = FindHeadFrame(dowels);
  EXPECT_TRUE(frame.left.isApprox(Vec3(1, 0, 0), 1e-12));
  EXPECT_TRUE(frame.up.isApprox(Vec3(0, 0, 1), 1e-12));
  ASSERT_EQ(frame.orbits.size(), 1);
  EXPECT_TRUE(frame.orbits[0].isApprox(Vec3(32, 0, -8), 1e-12));
  std::erase_if(dowels, [](const Dowel& dowel) { return dowel.site == "mso_l"; });
  EXPECT_TRUE(FindHeadFrame(dowels).orbits[0].isApprox(Vec3(34, 0, -28), 1e-12));
  std::erase_if(dowels, [](const Dowel& dowel) { return dowel.site == "mio_l"; });
  EXPECT_EQ(FindHeadFrame(dowels).orbits.size(), 1);
}

// A plate of 40 x 40 mm, dented by 7 mm in its middle, raised to a box by a point far below.
TEST(BoneGeometry, IsTheDepthBelowTheHullWhereItFacesAndHowFarAnOrbitIs) {
  TriMesh mesh = Plate(40, 4);
  const auto middle = static_cast<Eigen::Index>(
      std::ranges::min_element(mesh.points, {},
                               [](const Vec3& p) { return (p - Vec3(20, 20, 0)).norm(); }) -
      mesh.points.begin());
  mesh.points[static_cast<std::size_t>(middle)].z() -= 7;
  mesh.points.emplace_back(20, 20, -500);
  HeadFrame frame = FindHeadFrame(Head(Mat3::Identity()));
  frame.orbits = {Vec3(20, 20, 3), Vec3(1000, 0, 0)};
  const Eigen::MatrixXd geometry = BoneGeometry(mesh, frame);
  EXPECT_NEAR(geometry(0, middle), 7, 1e-9);
  EXPECT_NEAR(geometry(3, middle), 10, 1e-9);
  EXPECT_NEAR(geometry(0, 0), 0, 1e-9);
  EXPECT_NEAR(geometry(1, 0), 0, 1e-9);  // the plate faces up
  EXPECT_NEAR(geometry(2, 0), 1, 1e-9);
}

}  // namespace
}  // namespace semblance::interp
