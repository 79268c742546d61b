// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/statistics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;

TEST(Summarize, TellsTheMiddleAndTheSpread) {
  const SampleSummary s = Summarize(std::vector<double>{7, 1, 3, 2, 10});
  EXPECT_EQ(s.n, 5);
  EXPECT_DOUBLE_EQ(s.mean, 4.6);
  EXPECT_DOUBLE_EQ(s.median, 3);
  EXPECT_DOUBLE_EQ(s.quartile_1, 2);
  EXPECT_DOUBLE_EQ(s.quartile_3, 7);
  EXPECT_NEAR(s.sd, 3.7815340802, 1e-9);
  EXPECT_LT(s.mean_95.low, 4.6);
  EXPECT_GT(s.mean_95.high, 4.6);
  EXPECT_DOUBLE_EQ(Summarize(std::vector<double>{7, 1, 3, 2}).median, 2.5);
  EXPECT_TRUE(std::isnan(Summarize(std::vector<double>{}).mean));
  EXPECT_TRUE(std::isnan(Summarize(std::vector<double>{1, 2}).mean_95.low));
}

// The bootstrap of a mean is near the normal interval for many values.
TEST(Summarize, TheBootstrapIsNearTheNormalInterval) {
  std::vector<double> values;
  for (int n = 0; n < 200; ++n) {
    values.push_back(std::sin(12.9898 * n) * 3 + 5);
  }
  const SampleSummary s = Summarize(values);
  const double half = 1.96 * s.sd / std::sqrt(200);
  EXPECT_NEAR(s.mean_95.low, s.mean - half, 0.1 * half);
  EXPECT_NEAR(s.mean_95.high, s.mean + half, 0.1 * half);
}

// Hollander & Wolfe (1973), p. 29: depression scores of nine patients; V = 5, p = 0.03906.
TEST(Wilcoxon, ThePublishedExampleWithoutTies) {
  const std::vector<double> first = {1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30};
  const std::vector<double> second = {0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29};
  std::vector<double> differences;
  for (int n = 0; n < 9; ++n) {
    differences.push_back(second[n] - first[n]);
  }
  const WilcoxonResult w = Wilcoxon(differences);
  EXPECT_TRUE(w.exact);
  EXPECT_EQ(w.w_plus, 5);
  EXPECT_NEAR(w.p, 0.0390625, 1e-12);
}

// Brute force over all signs of six differences.
TEST(Wilcoxon, ExactIsTheCountOverAllSigns) {
  const std::vector<double> d = {1.5, -0.3, 2.2, 0.9, -1.1, 3.0};
  const std::vector<int> ranks = {4, 1, 5, 2, 3, 6};
  const double observed = 4 + 5 + 2 + 6;
  int as_far = 0;
  for (int signs = 0; signs < 64; ++signs) {
    int w = 0;
    for (int k = 0; k < 6; ++k) {
      w += (signs >> k & 1) ? ranks[k] : 0;
    }
    as_far += std::abs(w - 10.5) >= std::abs(observed - 10.5) ? 1 : 0;
  }
  EXPECT_NEAR(Wilcoxon(d).p, as_far / 64.0, 1e-12);
}

TEST(Wilcoxon, ZerosAreDroppedAndTiesAreNotExact) {
  const WilcoxonResult w = Wilcoxon(std::vector<double>{0, 1e-12, 1, 1, -2, 3});
  EXPECT_EQ(w.n, 4);
  EXPECT_FALSE(w.exact);
  EXPECT_EQ(w.w_plus, 1.5 + 1.5 + 4);
  EXPECT_TRUE(std::isnan(Wilcoxon(std::vector<double>{0, 0}).p));
}

// Worked by hand: 0.01 * 3, then 0.03 * 2, then 0.04 is lifted to the one before.
// Without ties it is 1 - 6 sum d^2 / (n (n^2 - 1)); only the order counts.
TEST(Spearman, IsTheCorrelationOfRanks) {
  EXPECT_NEAR(Spearman({1, 2, 3, 4, 5}, {2, 1, 4, 3, 5}), 1 - 6 * 4.0 / (5 * 24), 1e-12);
  EXPECT_NEAR(Spearman({1, 2, 3}, {10, 1000, 1e6}), 1, 1e-12);
  EXPECT_NEAR(Spearman({1, 2, 3}, {3, 2, 1}), -1, 1e-12);
  EXPECT_NEAR(Spearman({1, 2, 2, 3}, {1, 2, 3, 4}), 4.5 / std::sqrt(4.5 * 5), 1e-12);
  EXPECT_TRUE(std::isnan(Spearman({1, 2}, {1, 2})));
  EXPECT_TRUE(std::isnan(Spearman({1, 1, 1}, {1, 2, 3})));
  EXPECT_THROW(Spearman({1, 2, 3}, {1, 2}), InputError);
}

TEST(Holm, StepsDownAndNeverFalls) {
  EXPECT_THAT(
      Holm(std::vector<double>{0.04, 0.01, 0.03}),
      ElementsAre(DoubleNear(0.06, 1e-12), DoubleNear(0.03, 1e-12), DoubleNear(0.06, 1e-12)));
  EXPECT_THAT(Holm(std::vector<double>{0.9, 0.8}), ElementsAre(1, 1));
}

// Hollander & Wolfe (1973), p. 140: rounding first base in three ways, 22 players; with correction
// for ties chi2 = 11.143.
TEST(Friedman, ThePublishedExampleWithTies) {
  const std::vector<std::vector<double>> seconds = {
      {5.40, 5.50, 5.55}, {5.85, 5.70, 5.75}, {5.20, 5.60, 5.50}, {5.55, 5.50, 5.40},
      {5.90, 5.85, 5.70}, {5.45, 5.55, 5.60}, {5.40, 5.40, 5.35}, {5.45, 5.50, 5.35},
      {5.25, 5.15, 5.00}, {5.85, 5.80, 5.70}, {5.25, 5.20, 5.10}, {5.65, 5.55, 5.45},
      {5.60, 5.35, 5.45}, {5.05, 5.00, 4.95}, {5.50, 5.50, 5.40}, {5.45, 5.55, 5.50},
      {5.55, 5.55, 5.35}, {5.45, 5.50, 5.55}, {5.50, 5.45, 5.25}, {5.65, 5.60, 5.40},
      {5.70, 5.65, 5.55}, {6.30, 6.30, 6.25}};
  const FriedmanResult r = Friedman(seconds);
  EXPECT_NEAR(r.chi2, 11.1429, 5e-5);
  EXPECT_LT(r.p, 0.01);
}

// Demsar (2006), section 3.2.2: four treatments on 14 data sets differ if their ranks do by 1.25.
TEST(Friedman, TheCriticalDifferenceIsNemenyis) {
  std::vector<std::vector<double>> values(14, {1, 2, 3, 4});
  values[0] = {4, 3, 2, 1};
  EXPECT_NEAR(Friedman(values).critical_difference, 1.25, 5e-3);
}

TEST(Friedman, WithoutTiesItIsTheTextbookFormula) {
  const std::vector<std::vector<double>> values = {{1, 2, 3}, {1, 3, 2}, {2, 1, 3}, {1, 2, 3}};
  const FriedmanResult r = Friedman(values);  // rank sums 5, 8, 11
  EXPECT_NEAR(r.chi2, 12.0 / (4 * 3 * 4) * (25 + 64 + 121) - 3 * 4 * 4, 1e-12);
  EXPECT_NEAR(r.f, 3 * r.chi2 / (4 * 2 - r.chi2), 1e-12);
}

TEST(Friedman, RefusesWhatIsNoTable) {
  EXPECT_THROW(Friedman({}), InputError);
  EXPECT_THROW(Friedman({{1, 2}}), InputError);
  EXPECT_THROW(Friedman({{1, 2}, {1}}), InputError);
}

}  // namespace
}  // namespace semblance::problems
