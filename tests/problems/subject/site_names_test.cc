// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/site_names.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/subject/sites.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;

TEST(SiteCalled, EveryCodeNumberAndPrintedNameIsItsSite) {
  for (const Site& site : StandardSites()) {
    const std::string side = site.side == Side::kLeft ? "l" : site.side == Side::kRight ? "r" : "";
    EXPECT_EQ(SiteCalled(site.code).code, site.code);
    EXPECT_EQ(SiteCalled(fmt::format("{}{}", site.number, side)).code, site.code);
    EXPECT_EQ(SiteCalled(fmt::format("{} {}", site.name, side)).code, site.code) << site.name;
  }
}

TEST(SiteCalled, AlsoTheTablesOwnSites) {
  for (const Site& site : FurtherSites()) {
    const std::string side = site.side == Side::kLeft ? "l" : site.side == Side::kRight ? "r" : "";
    EXPECT_EQ(SiteCalled(site.code).code, site.code);
    EXPECT_EQ(SiteCalled(fmt::format("{} {}", site.name, side)).code, site.code) << site.name;
  }
  EXPECT_EQ(SiteCalled("SC left").code, "sC_l");
}

TEST(SiteCalled, SideBeforeOrBehindInAnyLetters) {
  for (const char* name : {"left gonion", "Gonion (L)", "GONION LEFT", "go_L", "L go", "18l",
                           "18_l", "left-gonion", "  go.l "}) {
    EXPECT_EQ(SiteCalled(name).code, "go_l") << name;
  }
  EXPECT_EQ(SiteCalled("right supra m2").code, "sM2_r");
  EXPECT_EQ(SiteCalled("SM2_R").code, "sM2_r");
  EXPECT_EQ(SiteCalled("rhinion").code, "rhi");
}

TEST(SiteCalled, SaysWhatIsWrong) {
  EXPECT_THAT(SiteCalled("gonion").fault, HasSubstr("stands on both sides"));
  EXPECT_THAT(SiteCalled("18").fault, HasSubstr("'go_l' or 'go_r'"));
  EXPECT_THAT(SiteCalled("left nasion").fault, HasSubstr("lies in the midline; write 'n'"));
  EXPECT_THAT(SiteCalled("nasoin").fault, HasSubstr("did you mean 'Nasion'?"));
  for (const char* name : {"", " ", "F-1", "22", "0", "l", "left"}) {
    EXPECT_EQ(SiteCalled(name).code, "") << name;
    EXPECT_THAT(SiteCalled(name).fault, HasSubstr("is not a site")) << name;
  }
}

}  // namespace
}  // namespace semblance
