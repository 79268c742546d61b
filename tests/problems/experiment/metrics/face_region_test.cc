// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/face_region.h"

#include <gtest/gtest.h>

#include <numeric>

#include "problems/subject/phantom.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

const Phantom& Head() {
  static const Phantom head = MakePhantom({.rings = 40});
  return head;
}

std::vector<SitePoint> SitesBut(const std::vector<std::string>& left_out) {
  std::vector<SitePoint> sites;
  for (const PhantomSite& s : Head().sites) {
    if (std::ranges::find(left_out, s.site) == left_out.end()) {
      sites.push_back({s.site, s.base});
    }
  }
  return sites;
}

ScoredSkin Scored(const std::vector<std::string>& left_out, FaceRegionOptions options = {}) {
  options.probe_mm = 15;  // quick, and a phantom has no nostrils
  return FindScoredSkin(Head().face, CompleteSites(SitesBut(left_out)), {}, {}, options);
}

double AreaAt(const ScoredSkin& skin, SkinStatus status) {
  return skin.area_cm2[static_cast<int>(status)];
}

// Scored in one and not in the other, cm^2.
double Difference(const ScoredSkin& a, const ScoredSkin& b) {
  const std::vector<double> areas = VertexAreas(Head().face);
  double sum = 0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    sum += a.region.scored[v] != b.region.scored[v] ? areas[v] / 100 : 0;
  }
  return sum;
}

TEST(ScoredSkin, IsTheFaceBetweenHairEarsAndChin) {
  const ScoredSkin skin = Scored({});
  EXPECT_GT(AreaAt(skin, SkinStatus::kScored), 300);
  EXPECT_LT(AreaAt(skin, SkinStatus::kScored), 500);
  EXPECT_EQ(AreaAt(skin, SkinStatus::kMasked), 0);
  EXPECT_NEAR(std::accumulate(skin.area_cm2.begin(), skin.area_cm2.end(), 0.0),
              Area(Head().face) / 100, 1e-6);
  for (std::size_t v = 0; v < skin.status.size(); ++v) {
    const Vec3& p = Head().face.points[v];
    EXPECT_EQ(skin.region.scored[v], skin.status[v] == SkinStatus::kScored);
    EXPECT_EQ(skin.region.part[v] >= 0, bool(skin.region.scored[v]));
    if (p.y() > 95 || p.z() > 80) {
      EXPECT_EQ(skin.status[v], SkinStatus::kBeyond);
    }
  }
}

TEST(ScoredSkin, IsTheSameWhateverLandmarksThereAre) {
  const ScoredSkin all = Scored({});
  const double area = AreaAt(all, SkinStatus::kScored);
  for (const PhantomSite& site : Head().sites) {
    EXPECT_LE(Difference(all, Scored({site.site})), 0.03 * area) << site.site;
  }
  EXPECT_LE(Difference(all, Scored({"id", "sm", "pg", "me", "go_l", "go_r", "mr_l", "mr_r", "iM2_l",
                                    "iM2_r"})),
            0.08 * area);
}

TEST(ScoredSkin, AZoneIsMaskedAlsoWhereTheSiteIsOnlyPredicted) {
  const FaceRegionOptions masked{.exclude = {{"zy_r", 30}}};
  for (const auto& left_out : {std::vector<std::string>{}, std::vector<std::string>{"zy_r"}}) {
    const ScoredSkin all = Scored(left_out), skin = Scored(left_out, masked);
    EXPECT_GT(AreaAt(skin, SkinStatus::kMasked), 10);
    EXPECT_NEAR(AreaAt(skin, SkinStatus::kScored) + AreaAt(skin, SkinStatus::kMasked),
                AreaAt(all, SkinStatus::kScored), 1e-9);
  }
  EXPECT_THROW(Scored({}, {.exclude = {{"elbow", 30}}}), InputError);
}

// A head with a smaller one in it, inside out: what an airway is.
TEST(ScoredSkin, InnerWallsAreLeftOutAndNoDistanceIsTakenToThem) {
  TriMesh skin = Head().face;
  const auto first = static_cast<std::int32_t>(skin.points.size());
  for (const Vec3& p : Head().face.points) {
    skin.points.push_back(Head().centre + 0.8 * (p - Head().centre));
  }
  for (const Triangle& t : Head().face.triangles) {
    skin.triangles.push_back({t[1] + first, t[0] + first, t[2] + first});
  }
  const SkullSites sites = CompleteSites(SitesBut({}));
  const ScoredSkin scored = FindScoredSkin(skin, sites, {}, {}, {.probe_mm = 15, .exclude = {}});
  EXPECT_NEAR(AreaAt(scored, SkinStatus::kScored), AreaAt(Scored({}), SkinStatus::kScored), 1e-9);
  EXPECT_GT(AreaAt(scored, SkinStatus::kInner), 100);
  for (std::size_t v = first; v < skin.points.size(); ++v) {
    EXPECT_FALSE(scored.region.outer[v]);
  }
}

TEST(ScoredSkin, TheNetworkIsStillThereToBeChosen) {
  EXPECT_THROW(Scored({}, {.extent = RegionExtent::kNetwork, .exclude = {}}),
               InputError);  // it has no area here
}

}  // namespace
}  // namespace semblance::problems
