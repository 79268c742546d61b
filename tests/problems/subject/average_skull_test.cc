// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/average_skull.h"
#include "problems/subject/landmark_files/read_landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "problems/subject/landmarks.h"
#include "problems/subject/phantom.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

const Similarity kPose = {
    1.1, Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix(), {10, -20, 300}};

// The sites of the average skull in a pose, each moved by a millimetre or two.
std::vector<SitePoint> Posed(bool mirrored = false) {
  Random random(7);
  std::vector<SitePoint> sites;
  for (const std::string& code : StandardSiteCodes()) {
    Vec3 p = AverageSite(code) +
             Vec3(random.BoundedNormal(), random.BoundedNormal(), random.BoundedNormal());
    p.x() *= mirrored ? -1 : 1;
    sites.push_back({code, kPose * p});
  }
  return sites;
}

std::vector<SitePoint> ReadSites(const std::string& name) {
  std::vector<SitePoint> sites;
  const LandmarkFile file =
      ReadLandmarks(SEMBLANCE_SOURCE_DIR "/configs/landmarks/" + name + ".yaml").file;
  for (const Landmark& l : file.landmarks) {
    sites.push_back({l.site, {l.point[0], l.point[1], l.point[2]}});
  }
  return sites;
}

TEST(AverageSkull, IsSymmetricWithNasionAtTheOrigin) {
  EXPECT_EQ(AverageSite("n"), Vec3::Zero());
  for (const Site& site : StandardSites()) {
    const Vec3 p = AverageSite(site.code), other = AverageSite(site.mirror);
    EXPECT_EQ(p, Vec3(-other.x(), other.y(), other.z())) << site.code;
    EXPECT_EQ(site.side == Side::kLeft, p.x() > 0) << site.code;
  }
  EXPECT_THROW(AverageSite("elbow"), InputError);
}

TEST(AverageSkull, FindsThePoseWithAThirdOfTheSitesWrong) {
  const SkullFit clean = FitAverageSkull(Posed());
  EXPECT_NEAR(clean.skull_from_average.scale, kPose.scale, 0.02);
  std::vector<SitePoint> sites = Posed();
  for (std::size_t k = 0; k < sites.size(); k += 3) {
    sites[k].point += Vec3(60, -40, 30.0 * static_cast<double>(k % 2));
  }
  const SkullFit fit = FitAverageSkull(sites);
  for (std::size_t k = 0; k < sites.size(); ++k) {
    EXPECT_LT((fit.Predicted(sites[k].site) - clean.Predicted(sites[k].site)).norm(), 2);
    EXPECT_EQ(fit.residual_mm[k] > 20, k % 3 == 0) << sites[k].site;
  }
}

TEST(AverageSkull, AMirrorImageFitsOnlyTheMirroredSkull) {
  const SkullFit as_is = FitAverageSkull(Posed(true));
  const SkullFit mirrored = FitAverageSkull(Posed(true), Handedness::kMirrored);
  EXPECT_LT(mirrored.median_mm, 4);
  EXPECT_GT(as_is.median_mm, 3 * mirrored.median_mm);
  for (const SitePoint& s : Posed(true)) {
    EXPECT_LT((mirrored.Predicted(s.site) - s.point).norm(), 10) << s.site;
  }
}

TEST(AverageSkull, RealHeadsAndPhantomsFitIt) {
  for (const char* name : {"cthead", "vhm", "cranium"}) {
    const SkullFit fit = FitAverageSkull(ReadSites(name));
    EXPECT_LT(fit.median_mm, 7) << name;
    EXPECT_LT(*std::ranges::max_element(fit.residual_mm), 12) << name;
    EXPECT_NEAR(fit.skull_from_average.scale, 1, 0.05) << name;
  }
  for (int seed = 1; seed <= 5; ++seed) {
    std::vector<SitePoint> sites;
    for (const PhantomSite& s :
         MakePhantom({.random_seed = static_cast<std::uint64_t>(seed), .rings = 8}).sites) {
      sites.push_back({s.site, s.base});
    }
    const SkullFit fit = FitAverageSkull(sites);
    EXPECT_LT(*std::ranges::max_element(fit.residual_mm), 25) << seed;
  }
}

TEST(AverageSkull, MissingSitesArePredicted) {
  for (const char* name : {"cthead", "vhm"}) {
    const std::vector<SitePoint> all = ReadSites(name);
    for (const SitePoint& left_out : all) {
      std::vector<SitePoint> rest = all;
      std::erase_if(rest, [&](const SitePoint& s) { return s.site == left_out.site; });
      const SkullSites sites = CompleteSites(rest);
      EXPECT_EQ(sites.points.size(), 32u);
      EXPECT_LT((sites.points.at(left_out.site) - left_out.point).norm(), 14) << left_out.site;
    }
  }
}

TEST(AverageSkull, RefusesTooFewAndALine) {
  EXPECT_THROW(FitAverageSkull({}), InputError);
  const std::vector<SitePoint> line = {{"g", {0, 0, 0}}, {"go_l", {0, 0, 50}}, {"pg", {0, 0, 90}}};
  EXPECT_THROW(FitAverageSkull(line), InputError);
}

}  // namespace
}  // namespace semblance::problems
