// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;

TEST(PointTable, ColumnsComeInAnyOrder) {
  const PointTable table =
      ParsePointTable("weight,z,v,x,u,y\n2,3,0.5,1,0.25,2\r\n 1 , -3e-1,.5,+1,0,2\n", "p.csv");
  ASSERT_EQ(table.positions.size(), 2u);
  EXPECT_EQ(table.positions[0], Vec3(1, 2, 3));
  EXPECT_EQ(table.positions[1], Vec3(1, 2, -0.3));
  EXPECT_EQ(table.uv[0], Vec2(0.25, 0.5));
  EXPECT_EQ(table.weights[0], 2);
  const PointTable bare = ParsePointTable("x,y,z\n1,2,3", "p.csv");
  EXPECT_EQ(bare.positions.size(), 1u);
  EXPECT_TRUE(bare.uv.empty() && bare.weights.empty());
}

TEST(PointTable, PlainAndOtherLinesGiveTheSame) {
  const PointTable plain = ParsePointTable("z,u,x,v,y\n3,.25,1e0,0.5,-2\n6,0,4,1,5\n", "p.csv"),
                   other =
                       ParsePointTable("z,u,x,v,y\r\n3, .25,+1,\"0.5\",-2\r\n6,0,4,1,5", "p.csv"),
                   ended = ParsePointTable("z,u,x,v,y\r\n3,.25,1,0.5,-2\r\n6,0,4,1,5\r\n", "p.csv");
  EXPECT_EQ(plain.positions[0], Vec3(1, -2, 3));
  for (const PointTable& table : {other, ended}) {
    EXPECT_EQ(table.positions, plain.positions);
    EXPECT_EQ(table.uv, plain.uv);
  }
}

TEST(PointTable, WhatIsWrongIsNamedWithItsLine) {
  const auto message = [](std::string_view text) -> std::string {
    try {
      ParsePointTable(text, "p.csv");
    } catch (const IoError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(message(""), HasSubstr("p.csv:1: '' is no column"));
  EXPECT_THAT(message("1,2,3\n"), HasSubstr("p.csv:1: '1' is no column"));
  EXPECT_THAT(message("x,y\n1,2\n"), HasSubstr("no column 'z'"));
  EXPECT_THAT(message("x,y,z,x\n"), HasSubstr("'x' stands twice"));
  EXPECT_THAT(message("x,y,z,u\n"), HasSubstr("'u' stands alone"));
  EXPECT_THAT(message("x,y,z\n"), HasSubstr("no point"));
  EXPECT_THAT(message("x,y,z\n1,2\n"), HasSubstr("p.csv:2: 2 entries for 3 columns"));
  EXPECT_THAT(message("x,y,z\n1,2,3\n1,2,3,4\n"), HasSubstr("p.csv:3: 4 entries"));
  EXPECT_THAT(message("x,y,z\n1,2,3\n\n1,2,3\n"), HasSubstr("p.csv:3: the line is empty"));
  EXPECT_THAT(message("x,y,z\n1,abc,3\n"), HasSubstr("column 'y': 'abc'"));
  for (const char* bad : {"nan", "inf", "1e999", "1;2", "0x10", "", "1 2"}) {
    EXPECT_THAT(message(std::string("x,y,z\n1,2,") + bad + "\n"), HasSubstr("column 'z'")) << bad;
  }
  EXPECT_THAT(message("x,y,z,weight\n1,2,3,0\n"), HasSubstr("weight is 0"));
}

}  // namespace
}  // namespace semblance
