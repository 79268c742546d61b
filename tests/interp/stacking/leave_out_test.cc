// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/stacking/leave_out.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "surfaces/base/random.h"

namespace semblance::interp {
namespace {

// Errors that follow the law give back its scale.
TEST(SdByDistance, FindsTheScaleOfItsOwnForm) {
  Random random(2);
  std::vector<double> errors, distances;
  for (int n = 0; n < 4000; ++n) {
    distances.push_back(random.Uniform(10, 30));
    errors.push_back(1.7 * std::sqrt(distances.back() / 20) * random.BoundedNormal());
  }
  const SdByDistance sd = FitSdByDistance(errors, distances);
  EXPECT_NEAR(sd.distance_mm, 20, 0.5);
  EXPECT_NEAR(sd.At(20), 1.7, 0.1);
}

TEST(SdByDistance, GrowsWithTheDistanceAndWithTheErrors) {
  const std::vector<double> errors = {1, -2, 1.5, -0.5}, distances = {10, 20, 30, 20};
  std::vector<double> twice = errors;
  for (double& error : twice) {
    error *= 2;
  }
  const SdByDistance sd = FitSdByDistance(errors, distances);
  EXPECT_GT(sd.At(20), sd.At(8));
  EXPECT_GT(sd.At(0), 0);
  EXPECT_NEAR(FitSdByDistance(twice, distances).At(13), 2 * sd.At(13), 1e-12);
}

TEST(SdByDistance, OfFewerThanThreeErrorsIsNone) {
  EXPECT_TRUE(std::isnan(
      FitSdByDistance(std::vector<double>{1, 2, kNaN}, std::vector<double>{1, 2, 3}).At(5)));
}

}  // namespace
}  // namespace semblance::interp
