// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/prior/depth_spread.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "problems/subject/sites.h"
#include "problems/subject/tissue_table.h"

namespace semblance {
namespace {

Dowel DowelAt(const std::string& site, double depth_mm) {
  Dowel dowel;
  dowel.site = site;
  dowel.depth_mm = depth_mm;
  return dowel;
}

// The T-Table, as it lies in configs/, is where the deviations are from.
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

TEST(DepthSpread, WhatATableStatesComesFirst) {
  Dowel dowel = DowelAt("go_l", 12);
  dowel.sd_mm = 2;
  EXPECT_EQ(PublishedSd_mm(dowel), 2);
  EXPECT_NEAR(DepthSd_mm({.own = 0.5, .shared = 1}, dowel), 1, 1e-12);
}

}  // namespace
}  // namespace semblance
