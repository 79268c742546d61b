// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using ::testing::Each;
using ::testing::IsEmpty;

// Sums of twelve uniform numbers: normal to a tenth of a per cent within two deviations.
TEST(Coverage, OfTrueDeviationsIsWhatTheyState) {
  Random random(1);
  std::vector<double> errors, sds;
  for (int n = 0; n < 20000; ++n) {
    sds.push_back(random.Uniform(0.5, 3));
    errors.push_back(sds.back() * random.BoundedNormal());
  }
  const std::vector<double> coverage = Coverage(errors, sds);
  ASSERT_EQ(coverage.size(), 19u);
  for (int k = 0; k < 19; ++k) {
    EXPECT_NEAR(coverage[k], (k + 1) / 20.0, 0.015) << k;
  }
  EXPECT_EQ(CoverageAt90(coverage), coverage[17]);
  for (double& sd : sds) {
    sd /= 2;  // too bold: within 1.645 / 2 deviations lie 58.9 %
  }
  EXPECT_NEAR(CoverageAt90(Coverage(errors, sds)), 0.589, 0.015);
}

TEST(Coverage, CountsByWeightAndLeavesOutWhatIsNotStated) {
  const std::vector<double> errors = {0, 10, kNaN, 5}, sds = {1, 1, 1, kNaN},
                            weights = {3, 1, 100, 100};
  EXPECT_THAT(Coverage(errors, sds, weights), Each(0.75));
  EXPECT_THAT(Coverage(errors, sds), Each(0.5));
}

TEST(Coverage, ADeviationOfZeroHoldsNoError) {
  EXPECT_THAT(Coverage(std::vector<double>{0, 1}, std::vector<double>{0, 0}), Each(0.5));
  EXPECT_THAT(Coverage(std::vector<double>{1e-15}, std::vector<double>{0}), Each(1));  // rounding
}

TEST(Coverage, OfNothingIsNothing) {
  EXPECT_THAT(Coverage({}, {}), IsEmpty());
  EXPECT_TRUE(std::isnan(CoverageAt90({})));
}

}  // namespace
}  // namespace semblance
