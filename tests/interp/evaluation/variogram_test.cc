// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/variogram.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/base/random.h"

namespace semblance::interp {
namespace {

// Two places of two values each: within a place half of 2^2, between them half the mean of
// 10^2, 8^2, 12^2 and 10^2.
TEST(Variogram, IsHalfTheMeanSquaredDifference) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 30, 0}, {1, 30, 0}};
  const std::vector<double> values = {0, 2, 10, 12};
  const std::vector<VariogramBin> bins = EmpiricalVariogram(points, values, {}, 10, 100);
  ASSERT_EQ(bins.size(), 2u);
  EXPECT_EQ(bins[0].pairs, 2);
  EXPECT_DOUBLE_EQ(bins[0].distance_mm, 1);
  EXPECT_DOUBLE_EQ(bins[0].semivariance_mm2, 2);
  EXPECT_EQ(bins[1].pairs, 4);
  EXPECT_DOUBLE_EQ(bins[1].semivariance_mm2, 51);
}

TEST(Variogram, IgnoresUnknownValuesAndZeroWeights) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  const std::vector<VariogramBin> bins = EmpiricalVariogram(
      points, std::vector<double>{1, kNaN, 3, 100}, std::vector<double>{1, 1, 1, 0}, 10, 100);
  ASSERT_EQ(bins.size(), 1u);
  EXPECT_EQ(bins[0].pairs, 1);
  EXPECT_DOUBLE_EQ(bins[0].semivariance_mm2, 2);
}

// A point of weight three counts as three points, both for few points, which are all used, and for
// many.
TEST(Variogram, DoesNotDependOnWhereAMeshIsFiner) {
  for (const int count : {60, 4000}) {
    Random random(5);
    std::vector<Vec3> points, split;
    std::vector<double> values, weights, of_split;
    for (int k = 0; k < count; ++k) {
      const Vec3 p = random.InBox(0, 100);
      points.push_back(p);
      values.push_back(p.x() / 10 + (k % 2 == 0 ? 1 : 0));
      weights.push_back(p.x() < 50 ? 3 : 1);
      for (int n = 0; n < weights.back(); ++n) {
        split.push_back(p);
        of_split.push_back(values.back());
      }
    }
    const auto by_weight = EmpiricalVariogram(points, values, weights, 20, 60);
    const auto finer = EmpiricalVariogram(split, of_split, {}, 20, 60);
    ASSERT_EQ(by_weight.size(), finer.size());
    for (std::size_t k = 1; k < finer.size(); ++k) {  // the first bin has pairs of one place
      EXPECT_NEAR(by_weight[k].semivariance_mm2, finer[k].semivariance_mm2,
                  count == 60 ? 1e-9 : 0.1 * finer[k].semivariance_mm2);
    }
  }
}

// A point that weighs as much as all others together is in half of the pairs' weight.
TEST(Variogram, APointOfSeveralStepsCountsSoManyTimes) {
  std::vector<Vec3> points;
  std::vector<double> values, weights;
  for (int k = 0; k < 2000; ++k) {
    points.emplace_back(0.001 * k, 0, 0);
    values.push_back(k == 1000 ? 2 : 0);
    weights.push_back(k == 1000 ? 1999 : 1);
  }
  const auto bins = EmpiricalVariogram(points, values, weights, 10, 100);
  ASSERT_EQ(bins.size(), 1u);
  // 2^2 / 2 in the pairs with it: w w of w w + w^2 / 2 of the others.
  EXPECT_NEAR(bins[0].semivariance_mm2, 2 * 2 / 3.0, 0.01);
}

TEST(Variogram, FitFindsTheModelThatMadeIt) {
  const VariogramModel truth{.nugget_mm2 = 1.5, .sill_mm2 = 20, .length_mm = 17};
  std::vector<VariogramBin> bins;
  for (int k = 0; k < 16; ++k) {
    const double distance_mm = 2.5 + 5 * k;
    bins.push_back({distance_mm, truth.At(distance_mm), 100 + 30 * k});
  }
  const VariogramModel found = FitVariogram(bins);
  EXPECT_NEAR(found.length_mm, 17, 1);  // lengths are tried in ratios of 1.08
  EXPECT_NEAR(found.nugget_mm2, 1.5, 0.4);
  EXPECT_NEAR(found.sill_mm2, 20, 0.5);
}

// Uncorrelated noise gives a nugget of its variance and no sill.
TEST(Variogram, OfNoiseIsItsVariance) {
  Random random(3);
  std::vector<Vec3> points;
  std::vector<double> values;
  for (int k = 0; k < 3000; ++k) {
    points.push_back(random.InBox(0, 100));
    values.push_back(2 * random.Normal());
  }
  const std::vector<VariogramBin> bins = EmpiricalVariogram(points, values, {}, 5, 60);
  std::int64_t pairs = 0;
  for (const VariogramBin& bin : bins) {
    pairs += bin.pairs;
  }
  EXPECT_LT(pairs, 1500 * 1499 / 2);
  EXPECT_NEAR(bins.back().semivariance_mm2, 4, 0.3);
  const VariogramModel model = FitVariogram(bins);
  EXPECT_NEAR(model.At(30), 4, 0.3);
}

TEST(Variogram, FitRefusesWhatCannotBeFitted) {
  EXPECT_TRUE(std::isnan(FitVariogram({}).length_mm));
  const std::vector<VariogramBin> flat = {{1, 0, 5}, {2, 0, 5}, {3, 0, 5}};
  EXPECT_TRUE(std::isnan(FitVariogram(flat).length_mm));
}

}  // namespace
}  // namespace semblance::interp
