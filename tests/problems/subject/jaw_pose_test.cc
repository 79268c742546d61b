// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/jaw_pose.h"
#include "problems/landmark_files/read_landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "problems/subject/landmarks.h"
#include "problems/subject/sites.h"
#include "surfaces/base/random.h"

namespace semblance {
namespace {

// An average skull in another pose and size, its sites known to noise_mm, the jaw open.
std::vector<SitePoint> Skull(double opening_deg, double noise_mm, std::uint64_t random_seed = 1) {
  const Vec3 hinge = (AverageCondyles()[0] + AverageCondyles()[1]) / 2;
  const Mat3 turn =
      Eigen::AngleAxisd(opening_deg * std::numbers::pi / 180, Vec3::UnitX()).toRotationMatrix();
  const Similarity pose{
      0.93, Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix(), {10, 20, 30}};
  Random random(random_seed);
  std::vector<SitePoint> sites;
  for (const std::string& code : StandardSiteCodes()) {
    const Vec3 closed = AverageSite(code);
    const Vec3 open = IsOfMandible(code) ? Vec3(hinge + turn * (closed - hinge)) : closed;
    sites.push_back({code, pose * (open + random.InBox(-noise_mm, noise_mm))});
  }
  return sites;
}

TEST(JawPose, IsTheHingesAngle) {
  for (const double opening_deg : {-5.0, 0.0, 10.0, 30.0}) {
    EXPECT_NEAR(FindJawPose(Skull(opening_deg, 0))->opening_deg, opening_deg, 1e-6);
  }
  EXPECT_NEAR(FindJawPose(Skull(0, 0))->off_mm, 0, 1e-6);
}

TEST(JawPose, BearsNoiseAndAWildSite) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    std::vector<SitePoint> sites = Skull(20, 4, seed);
    std::ranges::find(sites, "go_l", &SitePoint::site)->point += Vec3(0, 40, 30);
    EXPECT_NEAR(FindJawPose(sites)->opening_deg, 20, 6) << seed;
  }
}

TEST(JawPose, OfRealHeadsThatBiteIsSmall) {
  for (const char* name : {"cthead", "vhm"}) {
    std::vector<SitePoint> sites;
    for (const Landmark& l :
         ReadLandmarks(std::string(SEMBLANCE_SOURCE_DIR "/configs/landmarks/") + name + ".yaml")
             .file.landmarks) {
      sites.push_back({l.site, Vec3(l.point.data())});
    }
    EXPECT_LT(std::abs(FindJawPose(sites)->opening_deg), 10) << name;
  }
}

TEST(JawPose, NeedsSitesOfBothJaws) {
  std::vector<SitePoint> sites = Skull(0, 0);
  std::erase_if(sites, [](const SitePoint& s) { return IsOfMandible(s.site); });
  EXPECT_FALSE(FindJawPose(sites));
}

TEST(JawPose, TheCondylesMirrorEachOtherBehindTheFace) {
  const auto [left, right] = AverageCondyles();
  EXPECT_GT(left.x(), 40);
  EXPECT_EQ(left, Vec3(-right.x(), right.y(), right.z()));
}

}  // namespace
}  // namespace semblance
