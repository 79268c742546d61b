// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/plots/svg_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <pugixml.hpp>

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// The number of elements with a name. Fails if the text is not XML.
int CountElements(const std::string& svg, const char* name) {
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(svg.c_str()));
  int count = 0;
  for (const auto& node : document.child("svg").children(name)) {
    count += node ? 1 : 0;
  }
  return count;
}

const std::vector<BoxRow> kRows = {
    {"a <b> & \"c\"", {1, 2, 3, 4, 100}}, {"none", {}}, {"one", {5}}};

TEST(BoxPlot, HasEachValueAndABoxPerRow) {
  const std::string svg = BoxPlotSvg(kRows, "rms (mm)");
  EXPECT_EQ(CountElements(svg, "circle"), 6);
  EXPECT_EQ(CountElements(svg, "rect"), 2 + 1);  // the paper too
}

TEST(BoxPlot, KeepsTheHeadOfEachPartOfALongLabel) {
  const std::string svg = BoxPlotSvg(
      {{"minmax_octree least_emission=0.002, split decay=6 split=0.5 cut_below=0.002", {1}},
       {"a mere word that is much longer than there is room for, xyété été été été", {2}}},
      "");
  EXPECT_THAT(svg, HasSubstr("minmax_octree leas…, split decay=6 spli…"));
  EXPECT_THAT(svg, HasSubstr("a mere word that i…, xyété été ét…"));
}

TEST(CumulativePlot, HasALinePerRow) {
  EXPECT_EQ(CountElements(CumulativePlotSvg(kRows, "rms (mm)"), "polyline"),
            6);  // and one in the legend
}

TEST(QuantilePlot, EndsAtTheQuantileBelowTheLargestValue) {
  std::vector<double> quantiles;
  for (int k = 0; k <= 20; ++k) {
    quantiles.push_back(k < 20 ? 0.5 * k : 1000);
  }
  const std::string svg = QuantilePlotSvg({{"a", quantiles}}, "distance (mm)");
  EXPECT_EQ(CountElements(svg, "polyline"), 2);
  EXPECT_THAT(svg, HasSubstr(">10<"));  // the axis: 9.5 rounded up, not 1000
  EXPECT_THAT(svg, HasSubstr("60.00,340.00 "));
  EXPECT_THAT(svg, HasSubstr("829.50,36.00 \""));  // 9.5 of 10 mm, 95 %
}

TEST(ConvergencePlot, RunsFromStartToLastStepOnOneScale) {
  const std::string svg = ConvergencePlotSvg({{"a", {4, 2, 1}}, {"b", {3, 0}}}, "rms (mm)");
  EXPECT_EQ(CountElements(svg, "polyline"), 4);
  // Steps are evenly spaced from the left to the right edge; 4 mm is at the top, 0 at the bottom.
  EXPECT_THAT(svg, HasSubstr("points=\"60.00,34.00 465.00,187.00 870.00,263.50 \""));
  EXPECT_THAT(svg, HasSubstr("points=\"60.00,110.50 465.00,340.00 \""));
  EXPECT_THAT(svg, HasSubstr(">start<"));
}

TEST(CalibrationPlot, CalibratedRowsLieOnTheDiagonal) {
  const std::string svg = CalibrationPlotSvg({{"true", {0.25, 0.5, 0.75}}, {"bold", {0.1}}}, "%");
  EXPECT_EQ(CountElements(svg, "polyline"), 4);
  EXPECT_THAT(svg, HasSubstr("x1=\"60.00\" y1=\"340.00\" x2=\"870.00\" y2=\"20.00\""));
  EXPECT_THAT(svg, HasSubstr("points=\"60.00,340.00 262.50,260.00 465.00,180.00 667.50,100.00 "
                             "870.00,20.00\""));
  EXPECT_THAT(
      svg,
      HasSubstr("60.00,340.00 465.00,308.00 870.00,20.00\""));  // 10 % where 50 % is expected
}

TEST(Histograms, AreInProportionToEqualShares) {
  const std::string svg = HistogramsSvg({{"flat", {0.5, 0.5}}, {"to the left", {0.75, 0.25}}});
  EXPECT_EQ(CountElements(svg, "rect"), 4 + 1);  // the paper too
  // The tallest bar, 1.5 times the even share, is 110 pixels high.
  EXPECT_THAT(svg, HasSubstr("height=\"73.33\""));
  EXPECT_THAT(svg, HasSubstr("height=\"110.00\""));
  EXPECT_THAT(svg, HasSubstr("height=\"36.67\""));
  EXPECT_THAT(svg, HasSubstr("to the left"));
}

TEST(RankPlot, PutsTheBestFirst) {
  const std::string svg = RankPlotSvg({{"worse", 1.8}, {"better", 1.2}}, 0.4);
  EXPECT_EQ(CountElements(svg, "circle"), 2);
  EXPECT_LT(svg.find("better"), svg.find("worse"));
  EXPECT_EQ(
      CountElements(RankPlotSvg({{"a", 1}, {"b", 2}}, std::numeric_limits<double>::quiet_NaN()),
                    "circle"),
      2);
}

TEST(TickStep, IsRound) {
  EXPECT_DOUBLE_EQ(TickStep(0, 7, 7), 1);
  EXPECT_DOUBLE_EQ(TickStep(0, 10, 7), 2);
  EXPECT_DOUBLE_EQ(TickStep(0, 0.03, 7), 0.005);
  EXPECT_DOUBLE_EQ(TickStep(0, 65, 7), 10);
}

TEST(Plots, EqualValuesGiveAPlot) {
  EXPECT_EQ(CountElements(BoxPlotSvg({{"same", {2, 2, 2}}}, "x"), "circle"), 3);
  EXPECT_EQ(BoxPlotSvg({{"same", {2, 2, 2}}}, "x").find("nan"), std::string::npos);
}

std::vector<double> CirclesAlong(const std::string& svg, const char* coordinate) {
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(svg.c_str()));
  std::vector<double> places;
  for (const auto& circle : document.select_nodes("//circle")) {
    places.push_back(circle.node().attribute(coordinate).as_double());
  }
  return places;
}

TEST(AxisPlot, PointsAreInOrderWithTheirNames) {
  const std::string svg =
      AxisPlotSvg({{"line & <1>", {{3, 5, "c"}, {1, 1, "a\"<"}, {2, 2, "b"}}}}, "x", "y");
  const std::vector<double> x = CirclesAlong(svg, "cx"), y = CirclesAlong(svg, "cy");
  ASSERT_EQ(x.size(), 3u);
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.02);  // evenly spaced, like 1, 2, 3
  EXPECT_GT(y[0], y[1]);                        // larger is higher
  EXPECT_GT(y[1], y[2]);
  EXPECT_THAT(svg, HasSubstr("<title>a&quot;&lt;</title>"));
  EXPECT_THAT(svg, Not(HasSubstr("(logarithmic)")));
}

TEST(AxisPlot, PowersOfTenAreEvenlySpaced) {
  const std::string svg = AxisPlotSvg({{"a", {{0.01, 1, ""}, {0.1, 1, ""}, {1, 1, ""}}}}, "x", "y");
  const std::vector<double> x = CirclesAlong(svg, "cx");
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.02);
  EXPECT_THAT(svg, HasSubstr("x (logarithmic)"));
}

TEST(AxisPlot, ManyLinesAreCutAndCounted) {
  std::vector<AxisLine> lines(20, {"line", {{1, 1, ""}, {2, 2, ""}}});
  EXPECT_THAT(AxisPlotSvg(lines, "x", "y"), HasSubstr("and 8 more, not drawn"));
  EXPECT_THAT(AxisPlotSvg({{"one", {{1, 3, ""}}}}, "x", "y"), Not(HasSubstr("nan")));
}

// The sum of the counts in the titles of the bars.
int CountInBars(const std::string& svg) {
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(svg.c_str()));
  int sum = 0;
  for (const auto& title : document.select_nodes("//rect/title")) {
    const std::string text = title.node().text().as_string();
    sum += std::stoi(text.substr(text.rfind(' ')));
  }
  return sum;
}

TEST(Histogram, EveryValueExceptNaNIsInABar) {
  std::vector<double> values = {0, 1, NAN, 2.5, 1e-9, -1};
  EXPECT_EQ(CountInBars(HistogramSvg(values, {}, "x")), 4);
  values.assign(1000, 0.5);
  EXPECT_EQ(CountInBars(HistogramSvg(values, {{0.7, "a <mark>"}}, "x")), 1000);
  EXPECT_EQ(CountInBars(HistogramSvg({}, {}, "x")), 0);
}

TEST(Histogram, ValuesBeyondEveryWholeNumberAreInTheLastBar) {
  std::vector<double> values(100, 0.01);
  values.insert(values.end(), {1e15, 1e300, INFINITY});
  EXPECT_EQ(CountInBars(HistogramSvg(values, {}, "x")), 102);
}

TEST(Histogram, AFarOutlierEndsTheAxisEarly) {
  std::vector<double> values;
  for (int k = 0; k < 5000; ++k) {
    values.push_back(k % 100 / 100.0);
  }
  EXPECT_THAT(HistogramSvg(values, {}, "x"), Not(HasSubstr("the last bar holds all beyond it")));
  values.push_back(1000);
  const std::string svg = HistogramSvg(values, {{0.5, "half"}, {900, "far"}}, "x");
  EXPECT_THAT(svg, HasSubstr("half 0.5<"));
  EXPECT_THAT(svg, HasSubstr("far 900 →<"));
  EXPECT_THAT(svg, HasSubstr("the last bar holds all beyond it"));
  EXPECT_THAT(svg, HasSubstr("to inf: "));
  EXPECT_EQ(CountInBars(svg), 5001);
}

}  // namespace
}  // namespace semblance::problems
