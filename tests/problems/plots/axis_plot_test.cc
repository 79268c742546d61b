// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/plots/axis_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <pugixml.hpp>

namespace semblance {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::vector<double> CirclesAlong(const std::string& svg, const char* coordinate) {
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(svg.c_str()));
  std::vector<double> places;
  for (const auto& circle : document.select_nodes("//circle")) {
    places.push_back(circle.node().attribute(coordinate).as_double());
  }
  return places;
}

TEST(AxisPlot, PointsStandInOrderWithTheirNames) {
  const std::string svg =
      AxisPlotSvg({{"line & <1>", {{3, 5, "c"}, {1, 1, "a\"<"}, {2, 2, "b"}}}}, "x", "y");
  const std::vector<double> x = CirclesAlong(svg, "cx"), y = CirclesAlong(svg, "cy");
  ASSERT_EQ(x.size(), 3u);
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.02);  // evenly, for 1, 2, 3 are
  EXPECT_GT(y[0], y[1]);                        // larger is higher
  EXPECT_GT(y[1], y[2]);
  EXPECT_THAT(svg, HasSubstr("<title>a&quot;&lt;</title>"));
  EXPECT_THAT(svg, Not(HasSubstr("(logarithmic)")));
}

TEST(AxisPlot, PowersOfTenStandEvenly) {
  const std::string svg = AxisPlotSvg({{"a", {{0.01, 1, ""}, {0.1, 1, ""}, {1, 1, ""}}}}, "x", "y");
  const std::vector<double> x = CirclesAlong(svg, "cx");
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.02);
  EXPECT_THAT(svg, HasSubstr("x (logarithmic)"));
}

TEST(AxisPlot, ManyLinesAreCutAndSaid) {
  std::vector<AxisLine> lines(20, {"line", {{1, 1, ""}, {2, 2, ""}}});
  EXPECT_THAT(AxisPlotSvg(lines, "x", "y"), HasSubstr("and 8 more, not drawn"));
  EXPECT_THAT(AxisPlotSvg({{"one", {{1, 3, ""}}}}, "x", "y"), Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace semblance
