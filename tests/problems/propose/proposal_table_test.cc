// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/propose/proposal_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;

LandmarkFile FileOf(const std::vector<std::pair<std::string, double>>& x_of_site) {
  LandmarkFile file;
  for (const auto& [site, x] : x_of_site) {
    Landmark landmark;
    landmark.site = site;
    landmark.point = {x, 0, 0};
    file.landmarks.push_back(landmark);
  }
  return file;
}

TEST(ProposalTable, DistancesAndTheirQuantiles) {
  const ProposalComparison c = CompareProposal(FileOf({{"g", 1}, {"n", 4}, {"pg", 2}}),
                                               FileOf({{"g", 0}, {"n", 0}, {"pg", 0}}));
  EXPECT_EQ(c.compared, 3);
  EXPECT_EQ(c.median_mm, 2);
  EXPECT_EQ(c.nine_tenths_mm, 4);
  EXPECT_EQ(c.most_mm, 4);
}

TEST(ProposalTable, WhatOnlyOneHasIsSaidAndNotCounted) {
  const ProposalComparison c =
      CompareProposal(FileOf({{"g", 1}, {"n", 4}}), FileOf({{"g", 0}, {"pg", 0}}));
  EXPECT_EQ(c.compared, 1);
  const std::string text = TextOf(c);
  EXPECT_THAT(text, HasSubstr("proposed, and not placed by hand"));
  EXPECT_THAT(text, HasSubstr("placed by hand, and not proposed"));
  EXPECT_THAT(text, HasSubstr("1 sites: median 1.0 mm"));
}

TEST(ProposalTable, NothingInCommonIsAnError) {
  EXPECT_THROW(CompareProposal(FileOf({{"g", 1}}), FileOf({{"n", 1}})), InputError);
}

}  // namespace
}  // namespace semblance
