// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/leave_one_out.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "problems/subject/condition_depths.h"
#include "problems/subject/sites.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

// People of a known distribution, whose body mass index is correlated with their mean depth.
std::vector<CountedSubject> People(int count) {
  const std::vector<std::string> sites = StandardSiteCodes();
  const Eigen::MatrixXd root = ModelledCorrelation({}, sites).llt().matrixL();
  Random random(21);
  std::vector<CountedSubject> people;
  for (int k = 0; k < count; ++k) {
    Eigen::VectorXd z(32);
    for (double& value : z) {
      value = random.Normal();
    }
    const Eigen::VectorXd depths = Eigen::VectorXd::Constant(32, 10) + 2 * root * z;
    CountedSubject& person = people.emplace_back();
    FileSubject files;  // not a phantom, whose body mass index is made up
    person.person.subject = files;
    person.person.bmi = 25 + 2 * (depths.mean() - 10) + random.Normal();
    for (Eigen::Index j = 0; j < 32; ++j) {
      person.depths.sites.push_back(
          {.site = sites[j], .depth_mm = depths[j], .confidence = 1, .why_not = ""});
    }
  }
  return people;
}

const PredictedSites& Way(const std::vector<PredictedSites>& ways, const std::string& name) {
  return *std::ranges::find(ways, name, &PredictedSites::name);
}

TEST(LeaveOneOut, KnownFactsHelpAndTheStatedIntervalsHold) {
  const auto people = People(60);
  PopulationFile file;
  const auto ways = LeaveOneOut(file, people, MakeSample(people, 0));
  ASSERT_EQ(ways.size(), 4u);
  EXPECT_LT(Way(ways, "person").scores.mae_mm, Way(ways, "mean").scores.mae_mm);
  EXPECT_LT(Way(ways, "known").scores.mae_mm, Way(ways, "person").scores.mae_mm);
  EXPECT_LT(Way(ways, "known").against_mean_mm.mean_95.high, 0);
  for (const PredictedSites& way : ways) {
    EXPECT_NEAR(way.scores.coverage_90, 0.9, 0.04) << way.name;  // shrunk: a little cautious
    EXPECT_EQ(way.scores.points, 60 * (32 - 6)) << way.name;     // g, pg, zy and go know themselves
  }
}

// The reference solution of the method "mean" is the mean of the others.
TEST(LeaveOneOut, TheSubjectIsNotInItsOwnMean) {
  auto people = People(5);
  for (CountedSubject& person : people) {
    person.person.bmi.reset();
  }
  const JointSample sample = MakeSample(people, 0);
  const auto ways = LeaveOneOut({}, people, sample);
  ASSERT_EQ(ways.size(), 2u);
  const PredictedDepth& depth = ways[0].depths.front();
  const auto at = std::ranges::find(sample.names, depth.site) - sample.names.begin();
  EXPECT_EQ(depth.site, "sg");
  EXPECT_NEAR(depth.predicted_mm, (sample.values.col(at).sum() - depth.depth_mm) / 4, 1e-9);
}

// If sex and age are known of one person only, they predict nothing. The method would equal "mean"
// and is left out.
TEST(LeaveOneOut, LeavesOutAMethodWithoutVaryingNumbers) {
  auto people = People(5);
  for (CountedSubject& person : people) {
    person.person.bmi.reset();
  }
  people[1].person.sex = Sex::kMale;
  people[1].person.age_years = 39;
  EXPECT_EQ(LeaveOneOut({}, people, MakeSample(people, 0)).size(), 2u);
  people[2].person.age_years = 52;
  EXPECT_EQ(LeaveOneOut({}, people, MakeSample(people, 0)).size(), 4u);
}

// A method without known sites would repeat the mean.
TEST(LeaveOneOut, LeavesOutTheMethodWithoutKnownSites) {
  const auto people = People(5);
  PopulationFile file;
  file.known.clear();
  const auto ways = LeaveOneOut(file, people, MakeSample(people, 0));
  ASSERT_EQ(ways.size(), 2u);
  EXPECT_EQ(ways[0].name, "mean");
  EXPECT_EQ(ways[1].name, "person");
  EXPECT_EQ(ways[0].scores.points, 5 * 32);
}

TEST(LeaveOneOut, TablesHaveUniqueNamesAndCountAssumptions) {
  auto people = People(5);
  people[0].person.sex = people[1].person.sex = Sex::kFemale;
  people[0].person.build = Build::kNormal;
  PopulationFile file;
  const std::string tables = SEMBLANCE_SOURCE_DIR "/configs/tables/";
  file.tables = {tables + "t_table_2023.yaml", tables + "t_table_2023.yaml",
                 tables + "rhine_caucasoid.yaml"};
  const auto ways = LeaveOneOut(file, people, MakeSample(people, 0));
  ASSERT_EQ(ways.size(), 7u);
  EXPECT_EQ(ways[4].name, "t_table_2023");
  EXPECT_EQ(ways[5].name, "t_table_2023 (2)");
  EXPECT_EQ(ways[5].assumed, 0);  // it is pooled
  EXPECT_EQ(ways[6].assumed, 4);
  EXPECT_EQ(ways[0].assumed, 0);
}

TEST(LeaveOneOut, ScoresAPublishedTableToo) {
  const auto people = People(12);
  PopulationFile file;
  file.tables = {SEMBLANCE_SOURCE_DIR "/configs/tables/t_table_2023.yaml"};
  const auto ways = LeaveOneOut(file, people, MakeSample(people, 0));
  EXPECT_EQ(ways.back().name, "t_table_2023");
  EXPECT_EQ(ways.back().scores.points, ways.front().scores.points);
}

}  // namespace
}  // namespace semblance::problems
