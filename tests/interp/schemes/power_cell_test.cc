// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/power_cell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::interp {
namespace {

// Sites around the origin, some of them above its plane.
std::vector<PowerSite> RandomSites(Random& random, int count, double height) {
  std::vector<PowerSite> sites;
  for (int k = 0; k < count; ++k) {
    const Vec2 place(random.Uniform(-10, 10), random.Uniform(-10, 10));
    const double above = random.Uniform(-height, height);
    sites.push_back({place, place.squaredNorm() + above * above});
  }
  return sites;
}

CellPolygon CellOf(const std::vector<PowerSite>& sites) {
  PowerCell cell(40);
  for (std::size_t k = 0; k < sites.size(); ++k) {
    cell.Cut(sites[k], static_cast<int>(k));
  }
  return cell.polygon();
}

bool Closed(const CellPolygon& cell) {
  return !cell.empty() && std::ranges::count(cell, kOpenEdge, &CellCorner::edge) == 0;
}

double TwiceArea(const CellPolygon& cell) {
  double twice = 0;
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const Vec2 &a = cell[i].at, &b = cell[(i + 1) % cell.size()].at;
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice;
}

TEST(PowerCell, HoldsJustThePointsThatNoSiteKeeps) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const std::vector<PowerSite> sites = RandomSites(random, 25, 5);
    const CellPolygon cell = CellOf(sites);
    for (const CellCorner& corner : cell) {
      for (const PowerSite& site : sites) {
        ASSERT_GE(site.At(corner.at), -1e-9 * site.distance2);
      }
      if (corner.edge != kOpenEdge) {
        ASSERT_NEAR(sites[corner.edge].At(corner.at), 0, 1e-9 * sites[corner.edge].distance2);
      }
    }
  }
}

TEST(PowerCell, TreeAndClippingGiveTheSameParts) {
  Random random(2);
  int by_tree = 0, closed = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const std::vector<PowerSite> sites = RandomSites(random, 5 + trial % 30, trial % 2 * 6);
    const CellPolygon cell = CellOf(sites);
    if (!Closed(cell)) {
      continue;
    }
    SiteAreas tree, clipped;
    SibsonAreasByClipping(sites, cell, clipped);
    double sum = 0;
    for (const double area : clipped) {
      sum += area;
    }
    ++closed;
    ASSERT_NEAR(sum, TwiceArea(cell), 1e-9 * sum) << trial;
    if (SibsonAreasByEnvelope(sites, cell, tree)) {
      ++by_tree;
      for (std::size_t k = 0; k < sites.size(); ++k) {
        ASSERT_NEAR(tree[k], clipped[k], 1e-9 * sum) << trial << " " << k;
      }
    }
  }
  EXPECT_GT(closed, 1500);
  EXPECT_GT(by_tree, closed * 8 / 10);
}

TEST(PowerCell, ASiteWhosePartLiesWhollyInsideIsFound) {
  // Four sites on a circle, and one directly above the point, whose part is the middle of the cell.
  const std::vector<PowerSite> sites = {
      {{10, 0}, 100}, {{0, 10}, 100}, {{-10, 0}, 100}, {{0, -10}, 100}, {{0.1, 0}, 20}};
  const CellPolygon cell = CellOf(sites);
  SiteAreas areas;
  EXPECT_FALSE(SibsonAreasByEnvelope(sites, cell, areas));
  SibsonAreas(sites, cell, areas);
  EXPECT_EQ(cell.size(), 4U);
  EXPECT_GT(areas[4], 0);
  EXPECT_NEAR(areas[0] + areas[1] + areas[2] + areas[3] + areas[4], 200, 1e-9);
}

TEST(PowerCell, SitesOnOneCircleShareAlike) {
  const std::vector<PowerSite> sites = {
      {{10, 0}, 100}, {{0, 10}, 100}, {{-10, 0}, 100}, {{0, -10}, 100}};
  const CellPolygon cell = CellOf(sites);
  SiteAreas areas;
  SibsonAreas(sites, cell, areas);
  for (const double area : areas) {
    EXPECT_NEAR(area, 50, 1e-9);
  }
}

}  // namespace
}  // namespace semblance::interp
