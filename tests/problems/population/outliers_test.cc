// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/outliers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "problems/subject/condition_depths.h"
#include "problems/subject/sites.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

JointSample People(int count, std::uint64_t random_seed) {
  JointSample sample{StandardSiteCodes(), Eigen::MatrixXd(count, 32)};
  const Eigen::MatrixXd root = ModelledCorrelation({}, sample.names).llt().matrixL();
  Random random(random_seed);
  for (Eigen::Index k = 0; k < count; ++k) {
    Eigen::VectorXd z(32);
    for (double& value : z) {
      value = random.Normal();
    }
    sample.values.row(k) = (Eigen::VectorXd::Constant(32, 10) + 2 * root * z).transpose();
  }
  return sample;
}

JointNormal Fitted(const JointSample& sample) { return FitPopulation(sample, {}, std::nullopt); }

TEST(FindOutliers, FindsADepthThatDisagreesWithItsNeighbours) {
  JointSample sample = People(60, 1);
  EXPECT_THAT(FindOutliers(sample, Fitted(sample), {.site_z = 5, .subject_z = 6}), IsEmpty());
  // The depth is within the range of its site, but not for a face that is so thin elsewhere.
  sample.values.row(17).setConstant(7.5);
  sample.values(17, 12) = 14;
  const auto found = FindOutliers(sample, Fitted(sample), {.site_z = 5, .subject_z = 6});
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].subject, 17);
  EXPECT_EQ(found[0].site, sample.names[12]);
  EXPECT_EQ(found[0].depth_mm, 14);
  EXPECT_LT(found[0].expected_mm, 10);
}

TEST(FindOutliers, FindsASubjectOfAnotherUnit) {
  JointSample sample = People(60, 2);
  sample.values.row(5) *= 3;
  const auto found = FindOutliers(sample, Fitted(sample), {});
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.back().subject, 5);
  EXPECT_TRUE(found.back().site.empty());
  const JointSample without = WithoutOutliers(sample, found);
  EXPECT_FALSE(without.values.row(5).array().isFinite().any());
}

TEST(FindOutliers, SkipsSitesOfFewSubjects) {
  JointSample sample = People(7, 3);
  sample.values(2, 2) = 90;
  EXPECT_THAT(FindOutliers(sample, Fitted(sample), {}), IsEmpty());
}

}  // namespace
}  // namespace semblance::problems
