// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/plots/factor_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <pugixml.hpp>
#include <string>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Two panels of two lines over three levels. No number occurs twice.
FactorPlot Plot() {
  return {.x_label = "markers",
          .y_label = "error (mm)",
          .levels = {"8", "16", "all"},
          .positions = {0, 1, 2},
          .lines = {"kriging", "a & <b>"},
          .panels = {{"flat", {{{9, {8, 10}}, {6, {5, 7}}, {3, {2, 4}}}, {{5}, {4.5}, {4.2}}}},
                     {"split", {{{9.5}, {6.5}, {3.5}}, {{5.1}, {4.6}, {4.3}}}}}};
}

std::vector<std::string> TitlesOf(const pugi::xml_document& document) {
  std::vector<std::string> titles;
  for (const auto& circle : document.select_nodes("//circle")) {
    titles.emplace_back(circle.node().child("title").text().as_string());
  }
  return titles;
}

TEST(FactorPlot, EveryMeanIsADotWithItsLevelsAndInterval) {
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(FactorPlotSvg(Plot()).c_str()));
  const std::vector<std::string> titles = TitlesOf(document);
  ASSERT_EQ(titles.size(), 12u);
  EXPECT_EQ(titles[0], "kriging, 8: 9 (8 to 10)");
  EXPECT_EQ(titles[3], "a & <b>, 8: 5");
  EXPECT_EQ(titles[11], "a & <b>, all: 4.3");
  EXPECT_EQ(document.select_nodes("//polyline").size(), 4u);
  EXPECT_EQ(document.select_nodes("//line[@stroke='#0072b2'][@stroke-width='2']").size(), 3u)
      << "one whisker per interval";
}

TEST(FactorPlot, PanelsShareOneScale) {
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(FactorPlotSvg(Plot()).c_str()));
  std::vector<double> y;
  for (const auto& circle : document.select_nodes("//circle")) {
    y.push_back(circle.node().attribute("cy").as_double());
  }
  // 9 and 6 in the first panel, 9.5 and 6.5 beside them: one mm is equally long in both.
  EXPECT_NEAR(y[1] - y[0], y[7] - y[6], 0.02);
  EXPECT_NEAR((y[0] - y[6]) / 0.5, (y[1] - y[0]) / 3, 0.05);
  EXPECT_GT(y[2], y[0]) << "smaller is lower";
}

TEST(FactorPlot, PowersOfTenAreEvenlySpaced) {
  FactorPlot plot = Plot();
  plot.positions = {0.1, 1, 10};
  pugi::xml_document document;
  const std::string svg = FactorPlotSvg(plot);
  ASSERT_TRUE(document.load_string(svg.c_str()));
  std::vector<double> x;
  for (const auto& circle : document.select_nodes("//circle")) {
    x.push_back(circle.node().attribute("cx").as_double());
  }
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.02);
  EXPECT_THAT(svg, HasSubstr("markers (logarithmic)"));
  EXPECT_THAT(FactorPlotSvg(Plot()), Not(HasSubstr("logarithmic")));
}

TEST(FactorPlot, LinesAndPanelsThatAreLeftOutAreCounted) {
  FactorPlot plot = Plot();
  for (int k = 0; k < 14; ++k) {
    plot.lines.push_back("more");
    for (FactorPanel& panel : plot.panels) {
      panel.lines.push_back({{1}, {1}, {1}});
    }
  }
  EXPECT_THAT(FactorPlotSvg(plot), HasSubstr("4 more lines and 0 more panels are not drawn"));
  EXPECT_THAT(FactorPlotSvg(Plot()), Not(HasSubstr("not drawn")));
}

TEST(FactorPlot, AMissingMeanIsRefused) {
  FactorPlot plot = Plot();
  plot.panels[1].lines[1].pop_back();
  EXPECT_THROW(FactorPlotSvg(plot), InputError);
  plot = Plot();
  plot.positions.pop_back();
  EXPECT_THROW(FactorPlotSvg(plot), InputError);
}

TEST(MeansPlot, RowsFollowTheirHeadings) {
  const std::string svg = MeansPlotSvg({{"scheme", "kriging", {1, {0.5, 1.5}}},
                                        {"scheme", "nearest", {2, {}}},
                                        {"markers", "all", {1.2, {1, 1.4}}}},
                                       "error (mm)");
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(svg.c_str()));
  EXPECT_THAT(TitlesOf(document),
              ElementsAre("kriging: 1 (0.5 to 1.5)", "nearest: 2", "all: 1.2 (1 to 1.4)"));
  EXPECT_EQ(document.select_nodes("//text[.='scheme']").size(), 1u);
  EXPECT_EQ(document.select_nodes("//line[@stroke='#0b5c8f']").size(), 2u);
}

}  // namespace
}  // namespace semblance::problems
