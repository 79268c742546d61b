// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/joint_normal.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "problems/subject/condition_depths.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using Eigen::Index;
using ::testing::HasSubstr;
using testing::WordsOf;

// A distribution of the 32 sites with the correlations of the model.
JointNormal JointSites(int sample = 0) {
  JointNormal joint{
      .names = StandardSiteCodes(), .mean = {}, .sd = {}, .correlation = {}, .sample = {}};
  const auto n = std::ssize(joint.names);
  joint.mean = Eigen::VectorXd::LinSpaced(n, 4, 20);
  joint.sd = joint.mean / 4;
  joint.correlation = ModelledCorrelation({}, joint.names);
  joint.sample.assign(n, sample);
  return joint;
}

// People drawn from the distribution, a row each.
Eigen::MatrixXd Draw(const JointNormal& joint, int count, Random& random) {
  const Eigen::MatrixXd s = joint.sd.asDiagonal() * joint.correlation * joint.sd.asDiagonal();
  const Eigen::MatrixXd root = s.llt().matrixL();
  Eigen::MatrixXd people(count, std::ssize(joint.names));
  for (Index k = 0; k < count; ++k) {
    Eigen::VectorXd z(people.cols());
    for (double& value : z) {
      value = random.Normal();
    }
    people.row(k) = (joint.mean + root * z).transpose();
  }
  return people;
}

TEST(Condition, KeepsKnownNumbers) {
  const JointNormal joint = JointSites();
  const std::vector<KnownValue> known = {{"g", 7.25}, {"go_l", 11.5}, {"pg", 6}};
  const ConditionalNormal given = Condition(joint, known);
  for (const KnownValue& value : known) {
    EXPECT_EQ(given.mean[*joint.Find(value.name)], value.value) << value.name;
    EXPECT_EQ(given.sd[*joint.Find(value.name)], 0) << value.name;
  }
}

TEST(Condition, WithNothingKnownIsTheDistribution) {
  const JointNormal joint = JointSites();
  const ConditionalNormal given = Condition(joint, {});
  EXPECT_TRUE(given.mean.isApprox(joint.mean));
  EXPECT_TRUE(given.sd.isApprox(joint.sd));
}

// The reference solution uses blocks of the precision matrix, the general inverse of the whole
// covariance.
TEST(Condition, AgreesWithThePrecisionMatrix) {
  const JointNormal joint = JointSites();
  const std::vector<KnownValue> known = {{"zy_l", 9}, {"n", 5}, {"mr_r", 21}};
  const ConditionalNormal given = Condition(joint, known);
  const Eigen::MatrixXd s = joint.sd.asDiagonal() * joint.correlation * joint.sd.asDiagonal();
  const Eigen::MatrixXd precision = s.fullPivLu().inverse();
  std::vector<Index> open, at;
  Eigen::VectorXd off(3);
  for (Index k = 0; k < 3; ++k) {
    at.push_back(*joint.Find(known[k].name));
    off[k] = known[k].value - joint.mean[at.back()];
  }
  for (Index k = 0; k < std::ssize(joint.names); ++k) {
    if (std::ranges::find(at, k) == at.end()) {
      open.push_back(k);
    }
  }
  const Eigen::MatrixXd inverse = precision(open, open).fullPivLu().inverse();
  const Eigen::VectorXd mean = joint.mean(open) - inverse * precision(open, at) * off;
  for (std::size_t k = 0; k < open.size(); ++k) {
    EXPECT_NEAR(given.mean[open[k]], mean[static_cast<Index>(k)], 1e-9);
    EXPECT_NEAR(given.sd[open[k]], std::sqrt(inverse.diagonal()[static_cast<Index>(k)]), 1e-9);
  }
}

// A number with a huge error carries no information; one with a small error nearly as much as an
// exact one.
TEST(Condition, ErrorsOfKnownNumbersCount) {
  const JointNormal joint = JointSites();
  const int at = *joint.Find("mso_l");
  const std::vector<KnownValue> exact = {{"mso_r", 20}}, unsure = {{"mso_r", 20, 1e6}},
                                nearly = {{"mso_r", 20, 1e-3}};
  EXPECT_NEAR(Condition(joint, unsure).mean[at], joint.mean[at], 1e-6);
  EXPECT_NEAR(Condition(joint, nearly).mean[at], Condition(joint, exact).mean[at], 1e-4);
  EXPECT_GT(std::abs(Condition(joint, exact).mean[at] - joint.mean[at]), 1);
}

// The distribution estimated from that many people of another distribution and the model.
JointNormal Population(int people) {
  JointNormal truth = JointSites();
  truth.correlation =
      ModelledCorrelation({.common = 0.1, .twins = 0.1, .own = 0.2, .length_mm = 30}, truth.names);
  Random random(11);
  return FitJointNormal({truth.names, Draw(truth, people, random)},
                        ModelledCorrelation({}, truth.names));
}

std::vector<KnownValue> AtTheirMeans(const JointNormal& joint,
                                     const std::vector<std::string>& names, double error_mm) {
  std::vector<KnownValue> known;
  for (const std::string& name : names) {
    known.push_back({name, joint.mean[*joint.Find(name)], error_mm});
  }
  return known;
}

// The parameters: none, few or many people behind a distribution; some or all sites known.
class KnownWithErrors : public ::testing::TestWithParam<std::tuple<int, bool>> {
 protected:
  const int people_ = std::get<0>(GetParam());
  const JointNormal joint_ = people_ > 0 ? Population(people_) : JointSites();
  const std::vector<std::string> names_ =
      std::get<1>(GetParam()) ? joint_.names
                              : std::vector<std::string>{"g", "pg", "zy_l", "zy_r", "go_l"};
  const std::vector<double> errors_mm_ = {0.02, 0.1, 0.2, 0.5, 1, 2, 5, 50};

  ConditionalNormal Given(double error_mm) const {
    return Condition(joint_, AtTheirMeans(joint_, names_, error_mm));
  }
};

TEST_P(KnownWithErrors, AreAtLeastAsCertainAsTheirErrorAndLessWithALargerOne) {
  Eigen::VectorXd last = Given(0).sd;
  for (const double error_mm : errors_mm_) {
    const Eigen::VectorXd sd = Given(error_mm).sd;
    for (const std::string& name : names_) {
      EXPECT_LE(sd[*joint_.Find(name)], error_mm) << name;
      EXPECT_GE(sd[*joint_.Find(name)], last[*joint_.Find(name)]) << name << ", " << error_mm;
    }
    last = sd;
  }
}

// With fewer effective regressors, the deviations from a sample of six shrink by up to a tenth,
// those from a sample of forty by up to a hundredth.
TEST_P(KnownWithErrors, InformTheOthersLessWithALargerError) {
  const double least = people_ == 6 ? 0.9 : people_ == 40 ? 0.99 : 1 - 1e-9;
  Eigen::VectorXd last = Given(0).sd;
  for (const double error_mm : errors_mm_) {
    const Eigen::VectorXd sd = Given(error_mm).sd;
    EXPECT_GE((sd - least * last).minCoeff(), 0) << error_mm;
    last = sd;
  }
}

TEST_P(KnownWithErrors, WithAHugeErrorAreAsUnknown) {
  const ConditionalNormal nothing = Condition(joint_, {}), given = Given(1e6);
  EXPECT_LT((given.sd - nothing.sd).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((given.mean - nothing.mean).cwiseAbs().maxCoeff(), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(People, KnownWithErrors,
                         ::testing::Values(std::tuple(0, false), std::tuple(0, true),
                                           std::tuple(6, false), std::tuple(40, false),
                                           std::tuple(40, true)));

// With more regressors than subjects the predictions are erratic and their deviations wide. A known
// number keeps its own certainty, and a number without information does not widen the others.
TEST(Condition, NumbersWithoutInformationDoNotWidenASmallSample) {
  const JointNormal joint = Population(6);
  const ConditionalNormal nothing = Condition(joint, {});
  for (const double error_mm : {0.05, 0.5, 5.0}) {
    const auto known = AtTheirMeans(joint, joint.names, error_mm);
    EXPECT_LE(Condition(joint, known).sd.maxCoeff(), error_mm);
  }
  const ConditionalNormal given = Condition(joint, AtTheirMeans(joint, joint.names, 1e6));
  EXPECT_LT((given.sd - nothing.sd).cwiseAbs().maxCoeff(), 1e-6);
}

// Thirty known numbers count as fewer regressors if a part of the correlations is the model's.
TEST(Condition, CountsEffectiveRegressors) {
  const JointNormal joint = Population(40);
  JointNormal exact = joint;
  exact.sample.assign(exact.sample.size(), 0);
  std::vector<std::string> names = joint.names;
  names.pop_back();
  const auto known = AtTheirMeans(joint, names, 0);
  const Index last = std::ssize(names);
  const double widening = Condition(joint, known).sd[last] / Condition(exact, known).sd[last];
  EXPECT_GT(widening, 1.1);
  EXPECT_LT(widening, 2);
}

// `random` draws the errors of the known numbers, in standard deviations; null means no errors.
double ShareWithin(const JointNormal& joint, const Eigen::MatrixXd& people,
                   const std::vector<std::string>& names, long& counted, double errors = 0,
                   Random* random = nullptr) {
  double within = 0;
  for (const auto person : people.rowwise()) {
    std::vector<KnownValue> known;
    for (const std::string& name : names) {
      const double error_mm = errors * joint.sd[*joint.Find(name)];
      const double off_mm = random == nullptr ? 0 : error_mm * random->Normal();
      known.push_back({name, person[*joint.Find(name)] + off_mm, error_mm});
    }
    const ConditionalNormal given = Condition(joint, known);
    for (Index j = 0; j < person.size(); ++j) {
      if (given.sd[j] > 0) {
        within += std::abs(person[j] - given.mean[j]) <= 1.6448536 * given.sd[j] ? 1 : 0;
        ++counted;
      }
    }
  }
  return within;
}

TEST(Condition, NinetyPercentHoldIfTheCovarianceIsKnown) {
  const JointNormal joint = JointSites();
  Random random(5);
  long counted = 0;
  const double within = ShareWithin(joint, Draw(joint, 4000, random), {"g", "pg", "zy_l"}, counted);
  EXPECT_NEAR(within / static_cast<double>(counted), 0.9, 0.005);
}

// With few people and no model, only the widening makes the interval hold; without it the coverage
// would be about 76 %.
TEST(Condition, NinetyPercentHoldWithFewPeople) {
  JointNormal truth = JointSites();
  const std::vector<Index> some = {0, 1, 5, 9, 12};
  truth.names = {"sg", "g", "pr", "me", "mso_l"};
  truth.mean = Eigen::VectorXd(truth.mean(some));
  truth.sd = Eigen::VectorXd(truth.sd(some));
  truth.correlation = Eigen::MatrixXd(truth.correlation(some, some));
  truth.sample.assign(5, 0);
  for (const double errors : {0.0, 0.5, 2.0}) {
    Random random(7);
    double within = 0;
    long counted = 0;
    for (int round = 0; round < 2000; ++round) {
      const JointSample sample{truth.names, Draw(truth, 12, random)};
      const JointNormal joint = FitJointNormal(sample, Eigen::MatrixXd::Identity(5, 5), 0.0);
      within += ShareWithin(joint, Draw(truth, 1, random), {"sg", "g", "pr"}, counted, errors,
                            errors > 0 ? &random : nullptr);
    }
    EXPECT_NEAR(within / static_cast<double>(counted), 0.9, 0.015) << errors;
  }
}

TEST(Condition, RefusesUnusableNumbers) {
  const JointNormal joint = JointSites();
  const std::vector<KnownValue> strange = {{"nose", 3}}, twice = {{"g", 3}, {"g", 4}},
                                endless = {{"g", INFINITY}};
  EXPECT_THAT(WordsOf<InputError>([&] { Condition(joint, strange); }), HasSubstr("'nose'"));
  EXPECT_THAT(WordsOf<InputError>([&] { Condition(joint, twice); }), HasSubstr("twice"));
  EXPECT_THAT(WordsOf<InputError>([&] { Condition(joint, endless); }), HasSubstr("finite"));
}

using Eigen::Index;
using ::testing::HasSubstr;
using testing::WordsOf;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// Two correlated numbers of that many people.
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

TEST(FitJointNormal, IsTheSamplesOwnIfItIsComplete) {
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

// The reference solution: if all people have the first number and some lack the second, the maximum
// likelihood mean of the second is that of its regression on the first (Anderson 1957).
TEST(FitJointNormal, EstimatesMissingNumbersFromTheOthers) {
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

TEST(FitJointNormal, ShrinksMoreTowardsTheModelWithFewerPeople) {
  Random random(6);
  Eigen::MatrixXd target = Eigen::MatrixXd::Identity(2, 2);
  target(0, 1) = target(1, 0) = 0.3;
  const JointSample few = Pairs(6, 0.6, random), many = Pairs(3000, 0.6, random);
  EXPECT_GT(ComputeShrinkage(few, target), ComputeShrinkage(many, target));
  EXPECT_LT(ComputeShrinkage(many, target), 0.05);
  EXPECT_EQ(ComputeShrinkage(Pairs(3, 0.6, random), target), 1);
  EXPECT_NEAR(FitJointNormal(few, target, 1.0).correlation(0, 1), 0.3, 1e-9);
}

// With more sites than people and with gaps, the result can still be conditioned.
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

}  // namespace semblance::problems
