// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/plots/histogram.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <pugixml.hpp>

namespace semblance {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// What the bars say they hold, summed up.
int Counted(const std::string& svg) {
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(svg.c_str()));
  int sum = 0;
  for (const auto& title : document.select_nodes("//rect/title")) {
    const std::string text = title.node().text().as_string();
    sum += std::stoi(text.substr(text.rfind(' ')));
  }
  return sum;
}

TEST(Histogram, EveryValueIsInABarAndNaNInNone) {
  std::vector<double> values = {0, 1, NAN, 2.5, 1e-9, -1};
  EXPECT_EQ(Counted(HistogramSvg(values, {}, "x")), 4);
  values.assign(1000, 0.5);
  EXPECT_EQ(Counted(HistogramSvg(values, {{0.7, "a <mark>"}}, "x")), 1000);
  EXPECT_EQ(Counted(HistogramSvg({}, {}, "x")), 0);
}

TEST(Histogram, ValuesBeyondEveryWholeNumberAreInTheLastBar) {
  std::vector<double> values(100, 0.01);
  values.insert(values.end(), {1e15, 1e300, INFINITY});
  EXPECT_EQ(Counted(HistogramSvg(values, {}, "x")), 102);
}

TEST(Histogram, AFarOutlierDoesNotFlattenTheRestAndIsSaid) {
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
  EXPECT_EQ(Counted(svg), 5001);
}

}  // namespace
}  // namespace semblance
