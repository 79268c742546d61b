// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
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

TEST(PointTable, SigmaBecomesAWeight) {
  for (const char* text : {"x,y,z,sigma\n1,2,3,0.5\n", "x,y,z,sigma\n1,2,3, 0.5\n"}) {
    const PointTable table = ParsePointTable(text, "p.csv");
    EXPECT_TRUE(table.weights_of_sigma);
    EXPECT_EQ(table.weights, std::vector<double>{4});
  }
  EXPECT_FALSE(ParsePointTable("x,y,z,weight\n1,2,3,4\n", "p.csv").weights_of_sigma);
}

TEST(PointTable, AttributesAreTheRequestedOnesInTheirOrder) {
  const std::vector<std::string> names = {"red", "heat"};
  for (const char* text :
       {"heat,x,y,z,red\n9,1,2,3,255\n8,1,2,4,0\n", "heat,x,y,z,red\n9,1,2,3, 255\n8,1,2,4,0\n"}) {
    const PointTable table = ParsePointTable(text, "p.csv", names);
    ASSERT_EQ(table.attributes.size(), 2u);
    EXPECT_EQ(table.attributes[0].name, "red");
    EXPECT_EQ(table.attributes[0].values, (std::vector<double>{255, 0}));
    EXPECT_EQ(table.attributes[1].values, (std::vector<double>{9, 8}));
    EXPECT_EQ(table.positions[1], Vec3(1, 2, 4));
  }
}

// A blank sends the second table to the general reader.
TEST(PointTable, ExactPointsAreKnownByTheirIndex) {
  for (const char* text :
       {"x,y,z,exact,nx,ny,nz\n1,2,3,0,0,0,1\n4,5,6,1,0,1,0\n7,8,9,1,0,0,0\n",
        "x,y,z,exact,nx,ny,nz\n1,2,3,0,0,0,1\n4, 5,6,1,0,1,0\n7,8,9,1,0,0,0\n"}) {
    const PointTable table = ParsePointTable(text, "p.csv");
    EXPECT_EQ(table.exact, (std::vector<std::uint32_t>{1, 2})) << text;
    EXPECT_EQ(table.exact_normals, (std::vector<Vec3>{Vec3(0, 1, 0), Vec3(0, 0, 0)}));
  }
  EXPECT_EQ(ParsePointTable("x,y,z,exact\n1,2,3,1\n", "p.csv").exact.size(), 1u);
}

TEST(PointTable, FaultsAreNamedWithTheirLine) {
  const auto message = [](std::string_view text) -> std::string {
    try {
      ParsePointTable(text, "p.csv");
    } catch (const IoError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(message(""), HasSubstr("p.csv:1: '' is not a column"));
  EXPECT_THAT(message("1,2,3\n"), HasSubstr("p.csv:1: '1' is not a column"));
  EXPECT_THAT(message("x,y\n1,2\n"), HasSubstr("no column 'z'"));
  EXPECT_THAT(message("x,y,z,x\n"), HasSubstr("'x' appears twice"));
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
  EXPECT_THAT(message("x,y,z,sigma\n1,2,3,-1\n"), HasSubstr("p.csv:2: the sigma is -1"));
  EXPECT_THAT(message("x,y,z,sigma,weight\n1,2,3,1,1\n"), HasSubstr("give one of them"));
  EXPECT_THAT(message("x,y,z,exact\n1,2,3,0.5\n"), HasSubstr("p.csv:2: exact is 0.5"));
  EXPECT_THAT(message("x,y,z,nx,ny,nz\n1,2,3,0,0,1\n"), HasSubstr("give all three and 'exact'"));
  EXPECT_THAT(message("x,y,z,exact,nx\n1,2,3,0,0\n"), HasSubstr("give all three and 'exact'"));
  EXPECT_THAT(message("x,y,z,heat\n1,2,3,1\n"), HasSubstr("what the option `attributes` names"));
  const std::vector<std::string> heat = {"heat"};
  EXPECT_THAT(testing::WordsOf<IoError>([&] { ParsePointTable("x,y,z\n1,2,3\n", "p.csv", heat); }),
              HasSubstr("no column 'heat'"));
}

}  // namespace
}  // namespace semblance::problems
