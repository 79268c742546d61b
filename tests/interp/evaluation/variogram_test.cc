// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/variogram.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/base/random.h"

namespace semblance {
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

TEST(Variogram, LeavesOutWhatIsUnknownAndWhatWeighsNothing) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  const std::vector<VariogramBin> bins = EmpiricalVariogram(
      points, std::vector<double>{1, kNaN, 3, 100}, std::vector<double>{1, 1, 1, 0}, 10, 100);
  ASSERT_EQ(bins.size(), 1u);
  EXPECT_EQ(bins[0].pairs, 1);
  EXPECT_DOUBLE_EQ(bins[0].semivariance_mm2, 2);
}

TEST(Variogram, FitFindsTheModelThatMadeIt) {
  const VariogramModel truth{.nugget_mm2 = 1.5, .sill_mm2 = 20, .length_mm = 17};
  std::vector<VariogramBin> bins;
  for (int k = 0; k < 16; ++k) {
    const double distance_mm = 2.5 + 5 * k;
    bins.push_back({distance_mm, truth.At(distance_mm), 100 + 30 * k});
  }
  const VariogramModel found = FitVariogram(bins);
  EXPECT_NEAR(found.length_mm, 17, 1);  // of lengths in ratios of 1.08
  EXPECT_NEAR(found.nugget_mm2, 1.5, 0.4);
  EXPECT_NEAR(found.sill_mm2, 20, 0.5);
}

// Noise that no neighbour shares is all nugget, of its variance.
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
}  // namespace semblance
