// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/plots/heat_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <pugixml.hpp>

#include "problems/pictures/colour_map.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

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
  ASSERT_EQ(cells.size(), 3u);  // none for what is missing
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

TEST(HeatMap, RowsOfAnotherLengthAreRefused) {
  EXPECT_THROW(HeatMapSvg({.rows = {"r"}, .columns = {"a", "b"}, .values = {{1}}, .title = ""}),
               InputError);
}

}  // namespace
}  // namespace semblance
