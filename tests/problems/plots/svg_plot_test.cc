// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/plots/svg_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <pugixml.hpp>

namespace semblance {
namespace {

using ::testing::HasSubstr;

// Numbers of elements of a name; fails if the text is no XML.
int Count(const std::string& svg, const char* name) {
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

TEST(BoxPlot, HasEachValueAndABoxARow) {
  const std::string svg = BoxPlotSvg(kRows, "rms (mm)");
  EXPECT_EQ(Count(svg, "circle"), 6);
  EXPECT_EQ(Count(svg, "rect"), 2 + 1);  // the paper too
}

TEST(BoxPlot, KeepsTheHeadOfEachPartOfALongLabel) {
  const std::string svg = BoxPlotSvg(
      {{"minmax_octree least_emission=0.002, split decay=6 split=0.5 cut_below=0.002", {1}},
       {"a mere word that is much longer than there is room for, xyété été été été", {2}}},
      "");
  EXPECT_THAT(svg, HasSubstr("minmax_octree leas…, split decay=6 spli…"));
  EXPECT_THAT(svg, HasSubstr("a mere word that i…, xyété été ét…"));
}

TEST(CumulativePlot, HasALineARow) {
  EXPECT_EQ(Count(CumulativePlotSvg(kRows, "rms (mm)"), "polyline"), 6);  // and one in the legend
}

TEST(QuantilePlot, EndsAtTheQuantileBelowTheLargestValue) {
  std::vector<double> quantiles;
  for (int k = 0; k <= 20; ++k) {
    quantiles.push_back(k < 20 ? 0.5 * k : 1000);
  }
  const std::string svg = QuantilePlotSvg({{"a", quantiles}}, "distance (mm)");
  EXPECT_EQ(Count(svg, "polyline"), 2);
  EXPECT_THAT(svg, HasSubstr(">10<"));  // the axis: 9.5 rounded up, not 1000
  EXPECT_THAT(svg, HasSubstr("60.00,340.00 "));
  EXPECT_THAT(svg, HasSubstr("829.50,36.00 \""));  // 9.5 of 10 mm, 95 %
}

TEST(ConvergencePlot, GoesFromTheStartToTheLastStepOnOneScale) {
  const std::string svg = ConvergencePlotSvg({{"a", {4, 2, 1}}, {"b", {3, 0}}}, "rms (mm)");
  EXPECT_EQ(Count(svg, "polyline"), 4);
  // From the left edge to the right one, a third step is as far again; 4 mm at the top, 0 below.
  EXPECT_THAT(svg, HasSubstr("points=\"60.00,34.00 465.00,187.00 870.00,263.50 \""));
  EXPECT_THAT(svg, HasSubstr("points=\"60.00,110.50 465.00,340.00 \""));
  EXPECT_THAT(svg, HasSubstr(">start<"));
}

TEST(CalibrationPlot, TrueStatementsLieOnTheDiagonal) {
  const std::string svg = CalibrationPlotSvg({{"true", {0.25, 0.5, 0.75}}, {"bold", {0.1}}}, "%");
  EXPECT_EQ(Count(svg, "polyline"), 4);
  EXPECT_THAT(svg, HasSubstr("x1=\"60.00\" y1=\"340.00\" x2=\"870.00\" y2=\"20.00\""));
  EXPECT_THAT(svg, HasSubstr("points=\"60.00,340.00 262.50,260.00 465.00,180.00 667.50,100.00 "
                             "870.00,20.00\""));
  EXPECT_THAT(
      svg,
      HasSubstr("60.00,340.00 465.00,308.00 870.00,20.00\""));  // 10 % where 50 % is expected
}

TEST(Histograms, ShowEqualSharesAtTheLineAndOthersInProportion) {
  const std::string svg = HistogramsSvg({{"flat", {0.5, 0.5}}, {"to the left", {0.75, 0.25}}});
  EXPECT_EQ(Count(svg, "rect"), 4 + 1);  // the paper too
  // Of 110 in all: 1.5 times the even share is the tallest.
  EXPECT_THAT(svg, HasSubstr("height=\"73.33\""));
  EXPECT_THAT(svg, HasSubstr("height=\"110.00\""));
  EXPECT_THAT(svg, HasSubstr("height=\"36.67\""));
  EXPECT_THAT(svg, HasSubstr("to the left"));
}

TEST(RankPlot, PutsTheBestFirst) {
  const std::string svg = RankPlotSvg({{"worse", 1.8}, {"better", 1.2}}, 0.4);
  EXPECT_EQ(Count(svg, "circle"), 2);
  EXPECT_LT(svg.find("better"), svg.find("worse"));
  EXPECT_EQ(
      Count(RankPlotSvg({{"a", 1}, {"b", 2}}, std::numeric_limits<double>::quiet_NaN()), "circle"),
      2);
}

TEST(TickStep, IsRound) {
  EXPECT_DOUBLE_EQ(TickStep(0, 7, 7), 1);
  EXPECT_DOUBLE_EQ(TickStep(0, 10, 7), 2);
  EXPECT_DOUBLE_EQ(TickStep(0, 0.03, 7), 0.005);
  EXPECT_DOUBLE_EQ(TickStep(0, 65, 7), 10);
}

TEST(Plots, AllValuesAlikeIsNoTrouble) {
  EXPECT_EQ(Count(BoxPlotSvg({{"same", {2, 2, 2}}}, "x"), "circle"), 3);
  EXPECT_EQ(BoxPlotSvg({{"same", {2, 2, 2}}}, "x").find("nan"), std::string::npos);
}

}  // namespace
}  // namespace semblance
