// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/prior/seed_trust.h"

#include <gtest/gtest.h>

#include <cmath>

namespace semblance {
namespace {

const std::vector<Vec3> kTips = {{0, 0, 0}, {100, 0, 0}};
const std::vector<Sphere> kNose = {{.center = {50, 0, 0}, .radius_mm = 10}};

TEST(SeedTrust, FallsWithTheDistanceFromTheNearestDowel) {
  const SeedTrustOptions options{.reach_mm = 20};
  EXPECT_EQ(TrustAt({0, 0, 0}, kTips, {}, options), 1);
  EXPECT_NEAR(TrustAt({0, 20, 0}, kTips, {}, options), std::exp(-1), 1e-15);
  EXPECT_NEAR(TrustAt({110, 0, 0}, kTips, {}, options), std::exp(-0.25), 1e-15);
  EXPECT_EQ(TrustAt({0, 20, 0}, {}, {}, options), 1);
}

TEST(SeedTrust, IsNoneInAFeatureAndWholeAtTwiceItsRadius) {
  const SeedTrustOptions far{.reach_mm = 1e6};
  for (const auto& [mm, trust] : {std::pair(0.0, 0.0), {10.0, 0.0}, {15.0, 0.5}, {20.0, 1.0}}) {
    EXPECT_NEAR(TrustAt({50, mm, 0}, kTips, kNose, far), trust, 1e-6) << mm;
  }
}

TEST(SeedTrust, SeedsOfWhichNothingIsKnownGo) {
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
}  // namespace semblance
