// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/conditional/fit_joint_normal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "problems/conditional/site_correlation.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_file.h"

namespace semblance {
namespace {

using Eigen::Index;
using ::testing::HasSubstr;
using testing::WordsOf;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// Two numbers that go together, of so many people.
JointSample Pairs(int count, double correlation, Random& random) {
  JointSample sample{{"a", "b"}, Eigen::MatrixXd(count, 2)};
  for (Index k = 0; k < count; ++k) {
    const double x = random.Normal();
    sample.values(k, 0) = 5 + 2 * x;
    sample.values(k, 1) =
        1 + 0.5 * (correlation * x + std::sqrt(1 - correlation * correlation) * random.Normal());
  }
  return sample;
}

TEST(FitJointNormal, IsTheSamplesOwnWhereAllIsThere) {
  Random random(3);
  const JointSample sample = Pairs(30, 0.7, random);
  const JointNormal joint = FitJointNormal(sample, Eigen::MatrixXd::Identity(2, 2), 0.0);
  const Eigen::MatrixXd off = sample.values.rowwise() - sample.values.colwise().mean();
  const Eigen::MatrixXd covariance = off.transpose() * off / 29;
  EXPECT_NEAR(joint.mean[0], sample.values.col(0).mean(), 1e-9);
  EXPECT_NEAR(joint.sd[1], std::sqrt(covariance(1, 1)), 1e-9);
  EXPECT_NEAR(joint.correlation(0, 1),
              covariance(0, 1) / std::sqrt(covariance(0, 0) * covariance(1, 1)), 1e-9);
}

// The oracle: where all have the one number and some lack the other, the likeliest mean of the
// other is that of its regression on the first (Anderson 1957).
TEST(FitJointNormal, TakesWhatIsMissingFromTheRest) {
  Random random(4);
  JointSample sample = Pairs(200, 0.9, random);
  double x = 0, y = 0, xx = 0, xy = 0;
  int n = 0;
  for (Index k = 0; k < sample.values.rows(); ++k) {
    if (sample.values(k, 0) > 6) {  // the missing ones are not like the others
      sample.values(k, 1) = kMissing;
    } else {
      x += sample.values(k, 0);
      y += sample.values(k, 1);
      ++n;
    }
  }
  for (Index k = 0; k < sample.values.rows(); ++k) {
    if (std::isfinite(sample.values(k, 1))) {
      xx += std::pow(sample.values(k, 0) - x / n, 2);
      xy += (sample.values(k, 0) - x / n) * (sample.values(k, 1) - y / n);
    }
  }
  const double expected = y / n + xy / xx * (sample.values.col(0).mean() - x / n);
  const JointNormal joint = FitJointNormal(sample, Eigen::MatrixXd::Identity(2, 2), 0.0);
  EXPECT_NEAR(joint.mean[1], expected, 2e-3);
  EXPECT_GT(std::abs(expected - y / n), 0.05);
  EXPECT_EQ(joint.sample[0], 200);
  EXPECT_EQ(joint.sample[1], n);
}

TEST(FitJointNormal, ShrinksTowardsTheModelTheMoreTheFewerPeopleThereAre) {
  Random random(6);
  Eigen::MatrixXd target = Eigen::MatrixXd::Identity(2, 2);
  target(0, 1) = target(1, 0) = 0.3;
  const JointSample few = Pairs(6, 0.6, random), many = Pairs(3000, 0.6, random);
  EXPECT_GT(ShrinkageOf(few, target), ShrinkageOf(many, target));
  EXPECT_LT(ShrinkageOf(many, target), 0.05);
  EXPECT_EQ(ShrinkageOf(Pairs(3, 0.6, random), target), 1);
  EXPECT_NEAR(FitJointNormal(few, target, 1.0).correlation(0, 1), 0.3, 1e-9);
}

// More sites than people, and gaps: the result can still be conditioned.
TEST(FitJointNormal, IsPositiveDefiniteWithFewerPeopleThanNumbers) {
  Random random(8);
  JointSample sample{StandardSiteCodes(), Eigen::MatrixXd(9, 32)};
  for (double& value : sample.values.reshaped()) {
    value = random.Uniform() < 0.2 ? kMissing : 10 + random.Normal();
  }
  const Eigen::MatrixXd target = ModelledCorrelation({}, sample.names);
  const JointNormal joint = FitJointNormal(sample, target);
  EXPECT_EQ(joint.correlation.llt().info(), Eigen::Success);
  EXPECT_GT(joint.shrinkage, 0.3);
}

TEST(FitJointNormal, RefusesANumberThatDoesNotVary) {
  JointSample sample{{"a", "b"}, Eigen::MatrixXd::Constant(4, 2, 3)};
  sample.values.col(0) << 1, 2, 3, 4;
  EXPECT_THAT(WordsOf<InputError>([&] { FitJointNormal(sample, Eigen::MatrixXd::Identity(2, 2)); }),
              HasSubstr("'b'"));
}

}  // namespace
}  // namespace semblance
