// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/quantile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace semblance::surfaces {
namespace {

double Of(const std::vector<double>& values, double share) {
  return Quantile(SortedValues(values), share);
}

// quantile(c(7, 1, 3, 2, 10), c(0, .2, .25, .5, .75, .8, 1), type = 2)
TEST(Quantile, IsRsTypeTwo) {
  const std::vector<double> odd = {7, 1, 3, 2, 10};
  EXPECT_EQ(Of(odd, 0), 1);
  EXPECT_EQ(Of(odd, 0.2), 1.5);
  EXPECT_EQ(Of(odd, 0.25), 2);
  EXPECT_EQ(Of(odd, 0.5), 3);
  EXPECT_EQ(Of(odd, 0.75), 7);
  EXPECT_EQ(Of(odd, 0.8), 8.5);
  EXPECT_EQ(Of(odd, 1), 10);
  EXPECT_EQ(Of({4, 1, 3, 2}, 0.5), 2.5);
  EXPECT_EQ(Of({5}, 0.3), 5);
}

// A value of weight 3 counts as three of weight 1, in any order; one of weight 0 not at all.
TEST(Quantile, AWholeWeightIsARepetition) {
  const std::vector<double> values = {4, 1, 9, 2}, weights = {2, 3, 1, 0};
  const std::vector<double> repeated = {1, 1, 1, 4, 4, 9};
  for (const double share : {0.0, 0.1, 0.3, 0.5, 0.6, 0.8, 0.9, 1.0}) {
    EXPECT_EQ(Quantile(SortedValues(values, weights), share), Of(repeated, share)) << share;
  }
}

// 0.3 * 10 and sums of 0.1 are not exact in binary.
TEST(Quantile, RoundingDoesNotHideAMeeting) {
  const std::vector<double> values = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  const std::vector<double> tenths(10, 0.1);
  EXPECT_EQ(Quantile(SortedValues(values, tenths), 0.3), 3.5);
  EXPECT_EQ(Quantile(SortedValues(values, tenths), 0.7), 7.5);
  EXPECT_EQ(Of(values, 0.7), 7.5);
}

TEST(Quantile, OfNothingIsNaN) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isnan(Of({}, 0.5)));
  EXPECT_TRUE(std::isnan(Of({inf, std::nan("")}, 0.5)));
  EXPECT_EQ(Of({inf, 3, std::nan("")}, 0.5), 3);
  EXPECT_TRUE(
      std::isnan(Quantile(SortedValues(std::vector<double>{1}, std::vector<double>{0}), 0.5)));
}

TEST(Quantile, TheUpperMedianIsOneOfTheValues) {
  std::vector<double> odd = {3, 1, 2}, even = {4, 1, 3, 2}, one = {7};
  EXPECT_EQ(UpperMedian(odd), 2);
  EXPECT_EQ(UpperMedian(even), 3);
  EXPECT_EQ(UpperMedian(one), 7);
  EXPECT_EQ(Quantile(even, 0.5), 2.5);
}

}  // namespace
}  // namespace semblance::surfaces
