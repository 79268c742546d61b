// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/prior_observations.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "problems/subject/sites.h"
#include "problems/subject/tissue_table.h"

namespace semblance::problems {
namespace {

Dowel DowelAt(const std::string& site, double depth_mm) {
  Dowel dowel;
  dowel.site = site;
  dowel.depth_mm = depth_mm;
  return dowel;
}

// The deviations are those of the T-Table in configs/.
TEST(DepthSpread, PublishedDeviationsAreThoseOfTheTTable) {
  const TissueTable table =
      ReadTissueTable(fmt::format("{}/configs/tables/t_table_2023.yaml", SEMBLANCE_SOURCE_DIR));
  double share = 0;
  int sites = 0, rows = 0;
  for (const TissueRow& row : table.rows) {
    const TissueCell& cell = row.values.begin()->second;
    share += *cell.sd / *cell.mean;
    ++rows;
    for (const Site& site : StandardSites()) {
      if (site.landmark == row.site) {
        EXPECT_EQ(PublishedSd_mm(DowelAt(site.code, 100)), *cell.sd) << site.code;
        ++sites;
      }
    }
  }
  EXPECT_EQ(sites, 23);  // 9 in the midline, 7 pairs
  EXPECT_NEAR(PublishedSd_mm(DowelAt("fe_l", 10)), 10 * share / rows, 0.1);
}

TEST(DepthSpread, TheTablesOwnDeviationComesFirst) {
  Dowel dowel = DowelAt("go_l", 12);
  dowel.sd_mm = 2;
  EXPECT_EQ(PublishedSd_mm(dowel), 2);
  EXPECT_NEAR(DepthSd_mm({.own = 0.5, .shared = 1}, dowel), 1, 1e-12);
}

const std::vector<Vec3> kTips = {{0, 0, 0}, {100, 0, 0}};
const std::vector<Sphere> kNose = {{.center = {50, 0, 0}, .radius_mm = 10}};

TEST(SeedTrust, FallsWithTheDistanceFromTheNearestDowel) {
  const SeedTrustOptions options{.reach_mm = 20};
  EXPECT_EQ(SeedTrust({0, 0, 0}, kTips, {}, options), 1);
  EXPECT_NEAR(SeedTrust({0, 20, 0}, kTips, {}, options), std::exp(-1), 1e-15);
  EXPECT_NEAR(SeedTrust({110, 0, 0}, kTips, {}, options), std::exp(-0.25), 1e-15);
  EXPECT_EQ(SeedTrust({0, 20, 0}, {}, {}, options), 1);
}

TEST(SeedTrust, IsNoneInAFeatureAndWholeAtTwiceItsRadius) {
  const SeedTrustOptions far{.reach_mm = 1e6};
  for (const auto& [mm, trust] : {std::pair(0.0, 0.0), {10.0, 0.0}, {15.0, 0.5}, {20.0, 1.0}}) {
    EXPECT_NEAR(SeedTrust({50, mm, 0}, kTips, kNose, far), trust, 1e-6) << mm;
  }
}

TEST(SeedTrust, SeedsWithoutTrustAreDropped) {
  std::vector<FitPoint> seeds;
  for (const double x : {0.0, 50.0, 200.0, 110.0}) {
    seeds.push_back({.label = "seed", .position = {x, 0, 0}, .uv = {0.5, 0.5}, .weight = 0.1});
  }
  WeighSeeds(kTips, kNose, {.reach_mm = 20}, seeds);
  ASSERT_EQ(seeds.size(), 2u);
  EXPECT_EQ(seeds[0].weight, 0.1);
  EXPECT_EQ(seeds[1].position.x(), 110);
  EXPECT_NEAR(seeds[1].weight, 0.1 * std::exp(-0.25), 1e-15);
}

}  // namespace
}  // namespace semblance::problems
