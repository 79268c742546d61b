// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/scores.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::interp {
namespace {

using ::testing::Each;
using ::testing::IsEmpty;

double NormalCumulative(double z) { return std::erfc(-z / std::numbers::sqrt2) / 2; }

// Half the width of the interval with a probability, by bisection of the distribution.
double HalfWidth(double sd_mm, double share) {
  double low = 0, high = 10 * sd_mm;
  for (int k = 0; k < 80; ++k) {
    const double middle = (low + high) / 2;
    (2 * NormalCumulative(middle / sd_mm) - 1 < share ? low : high) = middle;
  }
  return low;
}

// The definition summed over small steps: the squared distance of the forecast's distribution from
// the truth's, which jumps from 0 to 1.
double CrpsBySum(double error_mm, double sd_mm) {
  constexpr int kSteps = 400000;
  const double reach = 12 * sd_mm + std::abs(error_mm), step = 2 * reach / kSteps;
  double sum = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double x = -reach + (k + 0.5) * step;  // from the truth
    const double off = NormalCumulative((x - error_mm) / sd_mm) - (x >= 0 ? 1 : 0);
    sum += off * off * step;
  }
  return sum;
}

TEST(Crps, IsItsDefinition) {
  for (const double sd : {0.2, 1.0, 3.5}) {
    for (const double error : {-4.0, -0.3, 0.0, 0.7, 2.5}) {
      EXPECT_NEAR(GaussianCrps_mm(error, sd), CrpsBySum(error, sd), 1e-4) << error << " " << sd;
    }
  }
}

TEST(Crps, OfACertainForecastIsItsAbsoluteError) {
  EXPECT_NEAR(GaussianCrps_mm(2.5, 1e-9), 2.5, 1e-8);
}

TEST(IntervalScore, IsItsDefinition) {
  for (const double share : {0.5, 0.9, 0.95}) {
    for (const double error : {-5.0, -1.0, 0.2, 3.0}) {
      const double sd = 1.3, half = HalfWidth(sd, share);
      const double low = error - half, high = error + half, truth = 0;
      const double expected = (high - low) + 2 / (1 - share) * std::max(low - truth, 0.0) +
                              2 / (1 - share) * std::max(truth - high, 0.0);
      EXPECT_NEAR(GaussianIntervalScore_mm(error, sd, share), expected, 1e-9);
    }
  }
}

TEST(LogScore, IsLessTheLogarithmOfTheDensity) {
  const double h = 1e-5, sd = 0.8, error = 1.1;
  const double density =
      (NormalCumulative((error + h) / sd) - NormalCumulative((error - h) / sd)) / (2 * h);
  EXPECT_NEAR(GaussianLogScore(error, sd), -std::log(density), 1e-8);
}

// No forecast has a better mean score than the correct one.
TEST(Scores, AreProper) {
  Random random(3);
  std::vector<double> errors, shifted;
  for (int n = 0; n < 20000; ++n) {
    errors.push_back(2 * random.BoundedNormal());
    shifted.push_back(errors.back() + 0.3);
  }
  const auto of = [](const std::vector<double>& e, double sd) {
    return ScoreDepths(e, std::vector<double>(e.size(), sd));
  };
  const DepthScores best = of(errors, 2);
  for (const DepthScores& other : {of(errors, 1.7), of(errors, 2.3), of(shifted, 2)}) {
    EXPECT_GT(other.crps_mm, best.crps_mm);
    EXPECT_GT(other.log_score, best.log_score);
    EXPECT_GT(other.interval_score_90_mm, best.interval_score_90_mm);
  }
}

TEST(Scores, OfACorrectForecastAgreeWithItsSd) {
  Random random(5);
  std::vector<double> errors, sds;
  for (int n = 0; n < 40000; ++n) {
    sds.push_back(random.Uniform(0.5, 3));
    errors.push_back(sds.back() * random.BoundedNormal());
  }
  const DepthScores scores = ScoreDepths(errors, sds);
  EXPECT_NEAR(scores.coverage_50, 0.5, 0.015);
  EXPECT_NEAR(scores.coverage_90, 0.9, 0.01);
  EXPECT_NEAR(scores.coverage_95, 0.95, 0.01);
  ASSERT_EQ(scores.pit.size(), static_cast<std::size_t>(kPitBins));
  EXPECT_NEAR(std::accumulate(scores.pit.begin(), scores.pit.end(), 0.0), 1, 1e-12);
  for (const double share : scores.pit) {
    EXPECT_NEAR(share, 0.1, 0.01);
  }
}

TEST(Pit, DistinguishesTooThickFromTooThin) {
  EXPECT_NEAR(GaussianPit(1.6448536269514722, 1), 0.05, 1e-12);  // predicted too thick
  EXPECT_NEAR(GaussianPit(-1.6448536269514722, 1), 0.95, 1e-12);
}

TEST(Scores, AreMeansByWeightOverWhatIsKnown) {
  const std::vector<double> errors = {1, -2, kNaN, 4}, sds = {1, 2, 1, kNaN},
                            weights = {3, 1, 100, 2};
  const DepthScores scores = ScoreDepths(errors, sds, weights);
  EXPECT_EQ(scores.points, 3);
  EXPECT_EQ(scores.stated, 2);
  EXPECT_NEAR(scores.mae_mm, (3 * 1 + 2 + 2 * 4) / 6.0, 1e-12);
  EXPECT_NEAR(scores.rmse_mm, std::sqrt((3 * 1 + 4 + 2 * 16) / 6.0), 1e-12);
  EXPECT_NEAR(scores.bias_mm, (3 - 2 + 8) / 6.0, 1e-12);
  EXPECT_NEAR(scores.mean_sd_mm, 5 / 4.0, 1e-12);
  EXPECT_NEAR(scores.crps_mm, (3 * GaussianCrps_mm(1, 1) + GaussianCrps_mm(-2, 2)) / 4, 1e-12);
  EXPECT_EQ(scores.coverage_90, 1);
  EXPECT_EQ(scores.coverage_50, 0);
}

// The scores tend to these values as the sd decreases, without a jump at 0.
TEST(Scores, OfACertainForecastAreTheLimitsOfSmallDeviations) {
  for (const double error : {-0.3, 0.7}) {
    EXPECT_NEAR(GaussianCrps_mm(error, 0), GaussianCrps_mm(error, 1e-9), 1e-8);
    EXPECT_NEAR(GaussianIntervalScore_mm(error, 0, 0.9), GaussianIntervalScore_mm(error, 1e-9, 0.9),
                1e-7);
    EXPECT_EQ(GaussianPit(error, 0), error > 0 ? 0 : 1);
    EXPECT_EQ(GaussianLogScore(error, 0), std::numeric_limits<double>::infinity());
  }
  EXPECT_EQ(GaussianCrps_mm(0, 0), 0);
  EXPECT_EQ(GaussianIntervalScore_mm(0, 0, 0.9), 0);
  EXPECT_EQ(GaussianLogScore(0, 0), -std::numeric_limits<double>::infinity());
}

TEST(Scores, CountACertainForecastAsStated) {
  const DepthScores scores =
      ScoreDepths(std::vector<double>{0, 3, -1, 2, 1}, std::vector<double>{0, 0, 0, 2, kNaN});
  EXPECT_EQ(scores.stated, 4);
  EXPECT_EQ(scores.certain, 3);
  EXPECT_NEAR(scores.crps_mm, (3 + 1 + GaussianCrps_mm(2, 2)) / 4, 1e-12);
  EXPECT_NEAR(scores.interval_score_90_mm,
              (20 * 3 + 20 * 1 + GaussianIntervalScore_mm(2, 2, 0.9)) / 4, 1e-12);
  EXPECT_EQ(scores.coverage_50, 0.25);
  EXPECT_EQ(scores.coverage_90, 0.5);
  EXPECT_EQ(scores.mean_sd_mm, 0.5);
  EXPECT_EQ(scores.log_score, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(std::accumulate(scores.pit.begin(), scores.pit.end(), 0.0), 1, 1e-12);
  EXPECT_NEAR(scores.pit.front(), 0.275, 1e-12);  // one too thick, and a tenth of the right one
  EXPECT_EQ(ScoreDepths(std::vector<double>{1e-12, 1}, std::vector<double>{0, 1}).log_score,
            -std::numeric_limits<double>::infinity());
}

// The same points within the same intervals, by scores and by calibration.
TEST(Scores, CoverAsCalibrationDoes) {
  Random random(7);
  std::vector<double> errors, sds;
  for (int n = 0; n < 500; ++n) {
    sds.push_back(n % 3 == 0 ? 0 : random.Uniform(0.5, 3));
    errors.push_back(n % 6 == 0 ? 0 : random.BoundedNormal());
  }
  const DepthScores scores = ScoreDepths(errors, sds);
  const std::vector<double> coverage = Coverage(errors, sds);
  EXPECT_DOUBLE_EQ(scores.coverage_50, coverage[9]);
  EXPECT_DOUBLE_EQ(scores.coverage_90, coverage[17]);
  EXPECT_DOUBLE_EQ(scores.coverage_95, coverage[18]);
}

TEST(Scores, OfNothingAreNothing) {
  const DepthScores scores = ScoreDepths({}, {});
  EXPECT_EQ(scores.points, 0);
  EXPECT_TRUE(std::isnan(scores.mae_mm));
  EXPECT_TRUE(std::isnan(scores.crps_mm));
  EXPECT_TRUE(scores.pit.empty());
}

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
    sd /= 2;  // too small: 58.9 % lie within 1.645 / 2 deviations
  }
  EXPECT_NEAR(CoverageAt90(Coverage(errors, sds)), 0.589, 0.015);
}

TEST(Coverage, WeightsErrorsAndIgnoresThoseWithoutAnSd) {
  const std::vector<double> errors = {0, 10, kNaN, 5}, sds = {1, 1, 1, kNaN},
                            weights = {3, 1, 100, 100};
  EXPECT_THAT(Coverage(errors, sds, weights), Each(0.75));
  EXPECT_THAT(Coverage(errors, sds), Each(0.5));
}

TEST(Coverage, ADeviationOfZeroHoldsNoError) {
  EXPECT_THAT(Coverage(std::vector<double>{0, 1}, std::vector<double>{0, 0}), Each(0.5));
  EXPECT_THAT(Coverage(std::vector<double>{1e-15}, std::vector<double>{0}), Each(1));  // round-off
}

TEST(Coverage, OfNothingIsNothing) {
  EXPECT_THAT(Coverage({}, {}), IsEmpty());
  EXPECT_TRUE(std::isnan(CoverageAt90({})));
}

}  // namespace
}  // namespace semblance::interp
