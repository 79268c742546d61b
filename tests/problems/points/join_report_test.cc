// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/join_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace semblance {
namespace {

using ::testing::HasSubstr;

TEST(JoinReport, WhatDoesNotHoldIsSaid) {
  JoinReport report{.join = {},
                    .sha256 = "00",
                    .places = 7,
                    .largest_gap_mm = 1e-12,
                    .largest_angle_deg = 0.01,
                    .allowed_gap_mm = 1e-6};
  report.join.surface = "a/given.hspline.json";
  EXPECT_EQ(JoinLines({&report, 1})[0],
            "u0 joined to u1 of a/given.hspline.json (tangent_plane, 7 places): gap at most 1e-12 "
            "mm, tangent planes at most 0.01 degrees apart");
  EXPECT_EQ(JoinsJson({&report, 1})[0]["holds"], true);
  report.largest_angle_deg = 0.2;
  EXPECT_THAT(JoinLines({&report, 1})[0], HasSubstr("more than 0.1 degrees"));
  EXPECT_THAT(JoinLines({&report, 1})[0], HasSubstr("take more patches along it"));
  report.is_at_limit = true;
  EXPECT_THAT(JoinLines({&report, 1})[0], HasSubstr("less would need more than 500 places"));
  report.is_at_limit = false;
  report.join.continuity = JoinContinuity::kPosition;
  EXPECT_TRUE(report.Holds());
  report.largest_gap_mm = 1e-5;
  EXPECT_THAT(JoinLines({&report, 1})[0],
              HasSubstr("more than 1e-06 mm: take the given edge's patches"));
  EXPECT_FALSE(JoinReport().Holds());
}

}  // namespace
}  // namespace semblance
