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

TEST(Sites, FurtherSitesAreThoseOfTheTablesAndOfTheSideOfTheHead) {
  EXPECT_EQ(FurtherSites().size(), 21u);
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

// Caple and Stephan (2016) write the side behind the code without a sign.
TEST(FindSiteByName, AcceptsTheSideDirectlyAfterTheCodeOfAPair) {
  for (const Site& site : AllSites()) {
    if (site.side != Side::kMidline) {
      const char* const side = site.side == Side::kLeft ? "L" : "R";
      EXPECT_EQ(FindSiteByName(site.landmark + side).code, site.code);
    }
  }
  EXPECT_EQ(FindSiteByName("mr").code, "") << "the code of a pair, and no right side of 'm'";
  EXPECT_THAT(FindSiteByName("sgL").fault, HasSubstr("'sgl_l' or 'sgl_r'"));
  EXPECT_EQ(FindSiteByName("gR").code, "") << "in the midline";
  EXPECT_EQ(FindSiteByName("gonionL").code, "") << "only a code";
}

// The bone's point of the second molar has one name for both jaws, with an index above or below the
// line that many programs lose.
TEST(FindSiteByName, TakesTheMolarsPointOfBothJaws) {
  EXPECT_EQ(FindSiteByName("ecm\u00b2R").code, "sM2_r");
  EXPECT_EQ(FindSiteByName("ecm\u2082L").code, "iM2_l");
  EXPECT_EQ(FindSiteByName("sM\u00b2L").code, "sM2_l");
  EXPECT_EQ(FindSiteByName("ecm\u00b2R").note, "");
  EXPECT_EQ(FindSiteByName("ecm2 R").code, "sM2_r");
  EXPECT_THAT(FindSiteByName("ecm2R").note, HasSubstr("name the point of the lower jaw iM2"));
}

TEST(FindSiteByName, APointOnTheSkinIsNoSite) {
  for (const char* name : {"n'", "N`", "n\u00b4", "n\u2019", "n\u2032", "n\u02b9", "n\uff07", "n''",
                           "n\"", "go'R", "goR'", "left gonion\u2019", "soft tissue nasion",
                           "Soft-tissue pogonion", "skin n", "n (cutaneous)"}) {
    EXPECT_EQ(FindSiteByName(name).code, "") << name;
    EXPECT_THAT(FindSiteByName(name).fault, HasSubstr("names a point on the skin")) << name;
  }
  EXPECT_EQ(FindSiteByName("goR'", PointsLieOn::kSkin).code, "go_r");
  EXPECT_EQ(FindSiteByName("soft tissue nasion", PointsLieOn::kSkin).code, "n");
  EXPECT_EQ(FindSiteByName("skin", PointsLieOn::kSkin).code, "");
  for (const char* name : {"'n'", "\"n\"", "'n"}) {
    EXPECT_EQ(FindSiteByName(name).code, "n") << name << " is quoted";
  }
}

// Signs that are no separators belong to the name: the point may be another one, or doubtful.
TEST(FindSiteByName, DoesNotPassOverOtherSigns) {
  for (const char* name : {"n?", "n*", "g\u00f6", "n\u0301", "n+", "\u03b1n", "n~"}) {
    EXPECT_THAT(FindSiteByName(name).fault, HasSubstr("is not a site")) << name;
  }
  for (const char* name : {"go\u2013l", "go\u00a0l", "go, left", "Go [L]", "go/l"}) {
    EXPECT_EQ(FindSiteByName(name).code, "go_l") << name;
  }
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
