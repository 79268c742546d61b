// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/thinning/thinned_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "surfaces/base/random.h"

namespace semblance {
namespace {

struct Net {
  NetworkPlan plan;
  std::map<std::string, Vec3> points;
};

std::string Name(int i, int j) { return "p" + std::to_string(i) + "_" + std::to_string(j); }

// A flat grid of n x n squares, each of two areas, its inner points shaken a little.
Net Grid(int n) {
  Net net;
  Random random(2);
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const bool inner = i > 0 && j > 0 && i < n && j < n;
      const Vec3 shake = inner ? Vec3(0.2 * random.Uniform(-1, 1), 0.2 * random.Uniform(-1, 1), 0)
                               : Vec3(Vec3::Zero());
      net.points[Name(i, j)] = Vec3(i, j, 0) + shake;
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      net.plan.areas.push_back({Name(i, j), Name(i + 1, j), Name(i + 1, j + 1)});
      net.plan.areas.push_back({Name(i, j), Name(i + 1, j + 1), Name(i, j + 1)});
    }
  }
  return net;
}

// Above 0 for each area that faces up; NaN never.
double SignedArea(const Net& net, const std::array<std::string, 3>& area) {
  const Vec3 &a = net.points.at(area[0]), &b = net.points.at(area[1]), &c = net.points.at(area[2]);
  return (b - a).cross(c - a).z() / 2;
}

// No area turned over or flat, no edge of three areas, the same region covered.
void ExpectSound(const Net& net, const NetworkPlan& plan, double covered) {
  double sum = 0;
  std::map<std::set<std::string>, int> edges;
  for (const auto& area : plan.areas) {
    EXPECT_GT(SignedArea(net, area), 0);
    sum += SignedArea(net, area);
    for (int c = 0; c < 3; ++c) {
      const std::set<std::string> edge = {area[c], area[(c + 1) % 3]};
      EXPECT_LE(++edges[edge], 2);
    }
  }
  EXPECT_NEAR(sum, covered, 1e-9);
}

TEST(ThinnedNetwork, InnerSitesGoAndTheSameRegionIsCovered) {
  const Net net = Grid(5);
  Random random(9);
  for (int trial = 0; trial < 20; ++trial) {
    std::set<std::string> gone;
    for (int k = 0; k < 1 + trial / 2; ++k) {
      gone.insert(
          Name(1 + static_cast<int>(random.Index(4)), 1 + static_cast<int>(random.Index(4))));
    }
    const NetworkPlan thin = WithoutSites(net.plan, gone, net.points);
    ExpectSound(net, thin, 25);
    EXPECT_EQ(thin.areas.size(), 50 - 2 * gone.size());
    for (const auto& area : thin.areas) {
      for (const std::string& site : area) {
        EXPECT_FALSE(gone.contains(site)) << site;
      }
    }
  }
}

TEST(ThinnedNetwork, ABorderSiteMovesAlongTheBorder) {
  const Net net = Grid(4);
  const NetworkPlan thin = WithoutSites(net.plan, {Name(2, 0)}, net.points);
  ExpectSound(net, thin, 16);  // the border there is straight
  EXPECT_EQ(thin.areas.size(), 31u);
}

TEST(ThinnedNetwork, NothingGoneIsTheSamePlanAndUnknownSitesAreLeftAlone) {
  const Net net = Grid(3);
  EXPECT_EQ(WithoutSites(net.plan, {}, net.points).areas, net.plan.areas);
  EXPECT_EQ(WithoutSites(net.plan, {"elsewhere"}, net.points).areas, net.plan.areas);
}

}  // namespace
}  // namespace semblance
