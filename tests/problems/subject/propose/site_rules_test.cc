// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/site_rules.h"

#include <gtest/gtest.h>

#include <cmath>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

// A ball instead of a skull, because its farthest point in a direction is known.
constexpr double kRadius_mm = 40;
SkullShell Ball() { return AsShell(testing::SphereMesh(Vec3::Zero(), kRadius_mm, 120)); }

Vec3 OnBall(const Vec3& direction) { return kRadius_mm * direction.normalized(); }

TEST(SiteRules, EverySiteHasOne) {
  for (const std::string& site : StandardSiteCodes()) {
    EXPECT_FALSE(FindSiteRule(site).what.empty()) << site;
  }
  EXPECT_THROW(FindSiteRule("xx"), InputError);
}

TEST(SiteRules, WithoutADirectionTheClosestBoneCounts) {
  const Vec3 direction = Vec3(1, -2, 0.5).normalized();
  const SnappedSite found = SnapToBone("mio_l", 43 * direction, Ball(), Mat3::Identity());
  EXPECT_LT((found.point - OnBall(direction)).norm(), 0.1);
  EXPECT_NEAR(found.from_bone_mm, 3, 0.1);
  EXPECT_EQ(found.sharpness_mm, 0);
}

// On a ball the maximum of the rule's score lies on the great circle towards the direction, at an
// angle that follows from the radius R and the reach.
TEST(SiteRules, TheSiteGoesTowardsItsDirection) {
  const double start = 0.15;  // radians below and before the lowest point
  const Vec3 predicted = OnBall({0, -std::sin(start), -std::cos(start)});
  const SnappedSite found = SnapToBone("me", predicted, Ball(), Mat3::Identity());
  const double reach_mm = FindSiteRule("me").reach_mm;
  // The angle a that maximises cos(a) + (R / reach) cos(a - start).
  const double share = kRadius_mm / reach_mm;
  const double angle = std::atan2(share * std::sin(start), 1 + share * std::cos(start));
  EXPECT_LT((found.point - OnBall({0, -std::sin(angle), -std::cos(angle)})).norm(), 1.2);
  EXPECT_LT(found.point.z(), predicted.z());
  EXPECT_GT(found.sharpness_mm, 0);
}

TEST(SiteRules, SidesAreMirrorImages) {
  const Vec3 left = OnBall({1, 0.2, 0.1});
  const SkullShell ball = Ball();
  const Vec3 l = SnapToBone("zy_l", left, ball, Mat3::Identity()).point;
  const Vec3 r = SnapToBone("zy_r", {-left.x(), left.y(), left.z()}, ball, Mat3::Identity()).point;
  EXPECT_LT((Vec3(-l.x(), l.y(), l.z()) - r).norm(), 1e-6);
  EXPECT_GT(l.x(), left.x());
}

TEST(SiteRules, DirectionsTurnWithTheSkull) {
  const Mat3 turn = Eigen::AngleAxisd(1.2, Vec3(1, 1, 0).normalized()).toRotationMatrix();
  const Vec3 predicted = OnBall({0.1, -1, 0.1});
  const SkullShell ball = Ball();
  const Vec3 upright = SnapToBone("pg", predicted, ball, Mat3::Identity()).point;
  const Vec3 turned = SnapToBone("pg", turn * predicted, ball, turn).point;
  EXPECT_LT((turn * upright - turned).norm(), 1.5);  // the vertices are others
}

TEST(SiteRules, InTheMidlineASiteStaysThere) {
  const Vec3 predicted = OnBall({0.3, -1, 0});
  const Vec3 found = SnapToBone("g", predicted, Ball(), Mat3::Identity()).point;
  EXPECT_NEAR(found.x(), predicted.x(), 1.6);
}

}  // namespace
}  // namespace semblance::problems
