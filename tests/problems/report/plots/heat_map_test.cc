// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/plots/heat_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <pugixml.hpp>
#include <string>
#include <vector>

#include "problems/report/pictures/colour_map.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(HeatMap, ACellHasItsNumberItsColourAndItsLink) {
  const HeatMap map{.rows = {"r <1>", "r2"},
                    .columns = {"a", "b & c"},
                    .values = {{1, 2}, {NAN, 3}},
                    .title = "mm",
                    .links = {{"#t-1", ""}, {"", "#t-\"4"}}};
  const std::string svg = HeatMapSvg(map);
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(svg.c_str()));
  const auto cells = document.select_nodes("//rect[@class='cell']");
  ASSERT_EQ(cells.size(), 3u);  // none for a missing value
  const ColourMap colours = SequentialMap(0, 1);
  EXPECT_EQ(cells[0].node().attribute("fill").value(), HexText(ColourAt(colours, 0)));
  EXPECT_EQ(cells[1].node().attribute("fill").value(), HexText(ColourAt(colours, 0.5)));
  EXPECT_EQ(cells[2].node().attribute("fill").value(), HexText(ColourAt(colours, 1)));
  EXPECT_STREQ(cells[1].node().child("title").text().as_string(), "r <1> | b & c: 2");
  EXPECT_STREQ(cells[0].node().parent().attribute("href").value(), "#t-1");
  EXPECT_STREQ(cells[2].node().parent().attribute("href").value(), "#t-\"4");
  EXPECT_STREQ(cells[1].node().parent().name(), "svg");
  EXPECT_THAT(svg, HasSubstr("mm: 1 dark to 3 yellow"));
}

TEST(HeatMap, AllNumbersHaveTheSameDecimals) {
  const auto shown = [](double a, double b) {
    pugi::xml_document document;
    const std::string svg =
        HeatMapSvg({.rows = {"r"}, .columns = {"a", "b"}, .values = {{a, b}}, .title = ""});
    EXPECT_TRUE(document.load_string(svg.c_str()));
    std::vector<std::string> texts;
    for (const auto& cell : document.select_nodes("//text[@class='in-cell']")) {
      texts.push_back(cell.node().text().as_string());
    }
    return texts;
  };
  EXPECT_THAT(shown(2, 1.957), ElementsAre("2.00", "1.96"));
  EXPECT_THAT(shown(-12.34, 5), ElementsAre("-12.3", "5.0"));
  EXPECT_THAT(shown(1234, 0.5), ElementsAre("1234", "0"));
  EXPECT_THAT(shown(2e-7, 0), ElementsAre("2e-07", "0"));
}

TEST(HeatMap, RowsOfAnotherLengthAreRefused) {
  EXPECT_THROW(HeatMapSvg({.rows = {"r"}, .columns = {"a", "b"}, .values = {{1}}, .title = ""}),
               InputError);
}

}  // namespace
}  // namespace semblance::problems
