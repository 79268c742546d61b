// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/search_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace semblance {
namespace {

using ::testing::ElementsAre;

const SearchSpace kSpace = {{.low = -2, .high = 6},
                            {.low = 1e-3, .high = 10, .log = true},
                            {.low = 1, .high = 4, .whole = true},
                            {.low = 1, .high = 1000, .whole = true, .log = true},
                            {.choices = 3}};

TEST(SearchSpace, ACodeStandsForItsPointAndAnyCodeForAPointOfTheSpace) {
  Random random(1);
  for (int n = 0; n < 300; ++n) {
    const SearchPoint point = RandomPoint(kSpace, random);
    const SearchPoint again = Decode(kSpace, Encode(kSpace, point));
    for (std::size_t k = 0; k < point.size(); ++k) {
      EXPECT_NEAR(again[k], point[k], 1e-9 * std::abs(point[k]) + 1e-12);
    }
    Eigen::VectorXd code(std::ssize(AxesOfCode(kSpace)));
    for (double& x : code) {
      x = random.Uniform(-3, 4);
    }
    const SearchPoint any = Decode(kSpace, code);
    for (std::size_t k = 0; k < any.size(); ++k) {
      const double low = kSpace[k].choices > 0 ? 0 : kSpace[k].low;
      const double high = kSpace[k].choices > 0 ? kSpace[k].choices - 1 : kSpace[k].high;
      EXPECT_GE(any[k], low);
      EXPECT_LE(any[k], high);
      if (kSpace[k].whole || kSpace[k].choices > 0) {
        EXPECT_EQ(any[k], std::round(any[k]));
      }
    }
  }
}

TEST(SearchSpace, OutsideTheCubeACodeIsItsMirrorImage) {
  const SearchSpace space = {{.low = 0, .high = 1}};
  const auto at = [&](double x) { return Decode(space, Eigen::VectorXd::Constant(1, x))[0]; };
  EXPECT_NEAR(at(-0.2), 0.2, 1e-12);
  EXPECT_NEAR(at(1.3), 0.7, 1e-12);
  EXPECT_NEAR(at(2.4), 0.4, 1e-12);
}

TEST(SearchSpace, WholeNumbersAndChoicesAreEquallyLikely) {
  Random random(2);
  std::map<double, int> whole, choice;
  for (int n = 0; n < 12000; ++n) {
    const SearchPoint point = RandomPoint(kSpace, random);
    ++whole[point[2]];
    ++choice[point[4]];
  }
  ASSERT_EQ(whole.size(), 4u);
  ASSERT_EQ(choice.size(), 3u);
  for (const auto& [value, count] : whole) {
    EXPECT_NEAR(count, 3000, 250) << value;  // five standard deviations
  }
  for (const auto& [value, count] : choice) {
    EXPECT_NEAR(count, 4000, 260) << value;
  }
}

TEST(SearchSpace, ALogarithmicAxisIsEvenInFactors) {
  EXPECT_NEAR(PointAt({kSpace[1]}, std::vector{0.5})[0], 0.1, 1e-12);  // between 1e-3 and 10
  EXPECT_THAT(AxesOfCode(kSpace), ElementsAre(0, 1, 2, 3, 4, 4, 4));
}

}  // namespace
}  // namespace semblance
