// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/dowel_projection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The shell is a ball of 50 mm. The dowel points outward from a base at a given radius.
Dowel DowelAt(double radius_mm, double depth_mm, const Vec3& direction = Vec3(1, 2, 3)) {
  const Vec3 unit = direction.normalized();
  return {"g", radius_mm * unit, unit, depth_mm, kNaN};
}

class ShellDowelsTest : public ::testing::Test {
 protected:
  TriMesh shell_ = testing::SphereMesh({0, 0, 0}, 50, 120);
};

TEST_F(ShellDowelsTest, OnTheShellADowelStaysAsItIs) {
  const std::vector<Dowel> dowels = {DowelAt(50.0, 7), DowelAt(50.3, 7, {-1, 1, 0})};
  const ProjectedDowels projected = ProjectOntoShell(dowels, shell_, MeshQuery(shell_), 1);
  for (int n = 0; n < 2; ++n) {
    EXPECT_NEAR(projected.dowels_on_shell[n].depth_mm, 7, 0.05);
    EXPECT_LT((projected.dowels_on_shell[n].Tip() - dowels[n].Tip()).norm(), 1e-9);
  }
  EXPECT_TRUE(projected.notes.empty());
}

TEST_F(ShellDowelsTest, UnderTheShellItIsShortenedAndItsTipStays) {
  const std::vector<Dowel> dowels = {DowelAt(40, 25)};
  const ProjectedDowels projected = ProjectOntoShell(dowels, shell_, MeshQuery(shell_), 1);
  EXPECT_NEAR(projected.dowels_on_shell[0].base.norm(), 50, 0.05);
  EXPECT_NEAR(projected.dowels_on_shell[0].depth_mm, 15, 0.05);
  EXPECT_LT((projected.dowels_on_shell[0].Tip() - dowels[0].Tip()).norm(), 1e-9);
  EXPECT_THAT(projected.notes, ElementsAre(HasSubstr("10.0 mm over the bone")));
}

TEST_F(ShellDowelsTest, OneThatEndsUnderTheShellKeepsTheLeastDepthOverIt) {
  const ProjectedDowels projected =
      ProjectOntoShell(std::vector<Dowel>{DowelAt(40, 6)}, shell_, MeshQuery(shell_), 1.5);
  EXPECT_NEAR(projected.dowels_on_shell[0].base.norm(), 50, 0.05);
  EXPECT_EQ(projected.dowels_on_shell[0].depth_mm, 1.5);
  EXPECT_THAT(projected.notes, ElementsAre(HasSubstr("ends 4.0 mm under the shell")));
}

TEST_F(ShellDowelsTest, NoDowelIsMadeLonger) {
  const ProjectedDowels projected =
      ProjectOntoShell(std::vector<Dowel>{DowelAt(50, 0.4)}, shell_, MeshQuery(shell_), 1);
  EXPECT_LE(projected.dowels_on_shell[0].depth_mm, 0.4 + 1e-9);
}

TEST_F(ShellDowelsTest, PressedInADowelReachesOutAsFarAsAsked) {
  const std::vector<Dowel> dowels = {DowelAt(40, 6), DowelAt(50, 8, {-1, 1, 0})};
  const TriMesh bone = testing::SphereMesh({0, 0, 0}, 40, 120);
  const TriMesh pressed = IndentShell(shell_, dowels, bone, 3);
  const ProjectedDowels projected = ProjectOntoShell(dowels, pressed, MeshQuery(pressed), 1);
  EXPECT_NEAR(projected.dowels_on_shell[0].depth_mm, 3, 0.1);
  EXPECT_NEAR(projected.dowels_on_shell[1].depth_mm, 8, 0.1);
  EXPECT_LT((projected.dowels_on_shell[0].Tip() - dowels[0].Tip()).norm(), 0.1);
}

TEST_F(ShellDowelsTest, PressedInItStaysOutsideBoneAndTheRestStaysToTheBit) {
  const std::vector<Dowel> dowels = {DowelAt(40, 6)};
  const TriMesh bone =
      testing::SphereMesh({0, 0, 0}, 47, 120);  // bone stops the dimple, which should be 7 mm deep
  const TriMesh pressed = IndentShell(shell_, dowels, bone, 3);
  const Vec3 at = 50 * dowels[0].direction;
  double least = 50;
  for (std::size_t v = 0; v < shell_.points.size(); ++v) {
    least = std::min(least, pressed.points[v].norm());
    if ((shell_.points[v] - at).norm() > 17.5) {
      ASSERT_EQ(pressed.points[v], shell_.points[v]);
    }
  }
  EXPECT_NEAR(least, 47, 0.05);
}

TEST_F(ShellDowelsTest, NothingIsPressedInWhereDowelsReachOutOrPressingIsOff) {
  const TriMesh bone = testing::SphereMesh({0, 0, 0}, 40, 60);
  EXPECT_EQ(IndentShell(shell_, std::vector<Dowel>{DowelAt(40, 14)}, bone, 3).points,
            shell_.points);
  EXPECT_EQ(IndentShell(shell_, std::vector<Dowel>{DowelAt(40, 6)}, bone, 0).points, shell_.points);
}

}  // namespace
}  // namespace semblance::problems
