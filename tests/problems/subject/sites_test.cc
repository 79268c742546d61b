// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/sites.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

namespace semblance {
namespace {

using ::testing::HasSubstr;

TEST(Sites, AreTenInTheMidlineAndElevenPairs) {
  std::map<Side, int> count;
  std::set<std::string> codes;
  std::set<int> numbers;
  for (const Site& site : StandardSites()) {
    ++count[site.side];
    codes.insert(site.code);
    numbers.insert(site.number);
    EXPECT_EQ(site.side, SideOfSite(site.code)) << site.code;
    EXPECT_EQ(site.landmark, WithoutSide(site.code));
  }
  EXPECT_EQ(count,
            (std::map<Side, int>{{Side::kMidline, 10}, {Side::kLeft, 11}, {Side::kRight, 11}}));
  EXPECT_EQ(codes.size(), 32u);
  EXPECT_EQ(numbers.size(), 21u);
}

TEST(Sites, TheMirrorOfAMirrorIsTheSite) {
  std::map<std::string, Site> by_code;
  for (const Site& site : StandardSites()) {
    by_code[site.code] = site;
  }
  for (const auto& [code, site] : by_code) {
    const Site& mirror = by_code.at(site.mirror);
    EXPECT_EQ(mirror.mirror, code);
    EXPECT_EQ(mirror.number, site.number);
    EXPECT_EQ(mirror.side == site.side, site.side == Side::kMidline);
  }
}

TEST(Sites, AreNamedInWords) {
  EXPECT_EQ(SiteInWords("zy_r"), "zy_r (Zygomatic Arch, midway)");
  EXPECT_EQ(SiteInWords("go"), "go (Gonion)");
  EXPECT_EQ(SiteInWords("mmb_l"), "mmb_l (Mid-mandibular border)");
  EXPECT_EQ(SiteInWords("mine"), "mine");
}

TEST(Sites, TheFurtherOnesAreTheTablesOwn) {
  EXPECT_EQ(FurtherSites().size(), 13u);
  for (const Site& site : FurtherSites()) {
    EXPECT_TRUE(IsFurtherSite(site.code) && !IsStandardSite(site.code)) << site.code;
    EXPECT_EQ(ComplaintAboutLandmark(site.code), "");
    EXPECT_THAT(ComplaintAboutSite(site.code), HasSubstr("unknown site"));
  }
  EXPECT_THAT(ComplaintAboutLandmark("mmb"), HasSubstr("write 'mmb_l' or 'mmb_r'"));
}

TEST(Sites, AComplaintSaysWhatToWrite) {
  EXPECT_EQ(ComplaintAboutSite("go_l"), "");
  EXPECT_EQ(ComplaintAboutSite("go"), "site 'go' stands on both sides; write 'go_l' or 'go_r'");
  EXPECT_THAT(ComplaintAboutSite("gp_l"), HasSubstr("unknown site 'gp_l'"));
}

TEST(Sites, EachIsFoundByItsCodeAndIsTheMirrorOfItsMirror) {
  EXPECT_EQ(AllSites().size(), StandardSites().size() + FurtherSites().size());
  for (const Site& site : AllSites()) {
    EXPECT_EQ(FindSite(site.code), &site) << site.code;
    EXPECT_EQ(MirrorOf(MirrorOf(site.code)), site.code);
    EXPECT_EQ(MirrorOf(site.code) == site.code, site.side == Side::kMidline) << site.code;
  }
  EXPECT_EQ(FindSite("go"), nullptr);
  EXPECT_EQ(MirrorOf("mine"), "");
}

}  // namespace
}  // namespace semblance
