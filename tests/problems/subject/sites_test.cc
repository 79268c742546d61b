// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/sites.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

namespace semblance::problems {
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

TEST(Sites, AreDescribedWithTheirName) {
  EXPECT_EQ(DescribeSite("zy_r"), "zy_r (Zygomatic Arch, midway)");
  EXPECT_EQ(DescribeSite("go"), "go (Gonion)");
  EXPECT_EQ(DescribeSite("mmb_l"), "mmb_l (Mid-mandibular border)");
  EXPECT_EQ(DescribeSite("mine"), "mine");
}

TEST(Sites, FurtherSitesAreThoseOfTheTables) {
  EXPECT_EQ(FurtherSites().size(), 13u);
  for (const Site& site : FurtherSites()) {
    EXPECT_TRUE(IsFurtherSite(site.code) && !IsStandardSite(site.code)) << site.code;
    EXPECT_EQ(SiteFault(site.code), "");
    EXPECT_THAT(StandardSiteFault(site.code), HasSubstr("unknown site"));
  }
  EXPECT_THAT(SiteFault("mmb"), HasSubstr("write 'mmb_l' or 'mmb_r'"));
}

TEST(Sites, AFaultSaysWhatToWrite) {
  EXPECT_EQ(StandardSiteFault("go_l"), "");
  EXPECT_EQ(StandardSiteFault("go"), "site 'go' is on both sides; write 'go_l' or 'go_r'");
  EXPECT_THAT(StandardSiteFault("gp_l"), HasSubstr("unknown site 'gp_l'"));
}

TEST(Sites, EachIsFoundByItsCodeAndIsTheMirrorOfItsMirror) {
  EXPECT_EQ(AllSites().size(), StandardSites().size() + FurtherSites().size());
  for (const Site& site : AllSites()) {
    EXPECT_EQ(FindSite(site.code), &site) << site.code;
    EXPECT_EQ(MirroredSite(MirroredSite(site.code)), site.code);
    EXPECT_EQ(MirroredSite(site.code) == site.code, site.side == Side::kMidline) << site.code;
  }
  EXPECT_EQ(FindSite("go"), nullptr);
  EXPECT_EQ(MirroredSite("mine"), "");
}

using ::testing::HasSubstr;

TEST(FindSiteByName, EveryCodeNumberAndPrintedNameIsItsSite) {
  for (const Site& site : StandardSites()) {
    const std::string side = site.side == Side::kLeft ? "l" : site.side == Side::kRight ? "r" : "";
    EXPECT_EQ(FindSiteByName(site.code).code, site.code);
    EXPECT_EQ(FindSiteByName(fmt::format("{}{}", site.number, side)).code, site.code);
    EXPECT_EQ(FindSiteByName(fmt::format("{} {}", site.name, side)).code, site.code) << site.name;
  }
}

TEST(FindSiteByName, FindsFurtherSites) {
  for (const Site& site : FurtherSites()) {
    const std::string side = site.side == Side::kLeft ? "l" : site.side == Side::kRight ? "r" : "";
    EXPECT_EQ(FindSiteByName(site.code).code, site.code);
    EXPECT_EQ(FindSiteByName(fmt::format("{} {}", site.name, side)).code, site.code) << site.name;
  }
  EXPECT_EQ(FindSiteByName("SC left").code, "sC_l");
}

TEST(FindSiteByName, AcceptsTheSideBeforeOrAfterInAnyCase) {
  for (const char* name : {"left gonion", "Gonion (L)", "GONION LEFT", "go_L", "L go", "18l",
                           "18_l", "left-gonion", "  go.l "}) {
    EXPECT_EQ(FindSiteByName(name).code, "go_l") << name;
  }
  EXPECT_EQ(FindSiteByName("right supra m2").code, "sM2_r");
  EXPECT_EQ(FindSiteByName("SM2_R").code, "sM2_r");
  EXPECT_EQ(FindSiteByName("rhinion").code, "rhi");
}

TEST(FindSiteByName, StatesTheFault) {
  EXPECT_THAT(FindSiteByName("gonion").fault, HasSubstr("is on both sides"));
  EXPECT_THAT(FindSiteByName("18").fault, HasSubstr("'go_l' or 'go_r'"));
  EXPECT_THAT(FindSiteByName("left nasion").fault, HasSubstr("lies in the midline; write 'n'"));
  EXPECT_THAT(FindSiteByName("nasoin").fault, HasSubstr("did you mean 'Nasion'?"));
  for (const char* name : {"", " ", "F-1", "22", "0", "l", "left"}) {
    EXPECT_EQ(FindSiteByName(name).code, "") << name;
    EXPECT_THAT(FindSiteByName(name).fault, HasSubstr("is not a site")) << name;
  }
}

}  // namespace

}  // namespace semblance::problems
