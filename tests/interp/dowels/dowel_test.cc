// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/dowel.h"

#include <gtest/gtest.h>

namespace semblance::interp {
namespace {

TEST(SiteCode, EndsInItsSide) {
  EXPECT_EQ(SideOfSite("go_l"), Side::kLeft);
  EXPECT_EQ(SideOfSite("sM2_r"), Side::kRight);
  EXPECT_EQ(SideOfSite("g"), Side::kMidline);
  EXPECT_EQ(WithoutSide("go_l"), "go");
  EXPECT_EQ(WithoutSide("sM2_r"), "sM2");
  EXPECT_EQ(WithoutSide("g"), "g");
}

TEST(SiteCode, ASuffixAloneIsNoSide) {
  EXPECT_EQ(SideOfSite("_l"), Side::kMidline);
  EXPECT_EQ(WithoutSide("_l"), "_l");
}

}  // namespace
}  // namespace semblance::interp
