// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study_report/study_ranking.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "problems/study_report/study_charts.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

TrialRow Trial(const std::string& subject, const std::string& scheme, const std::string& weight,
               double value, double wall_s) {
  TrialRow row{.id = subject + scheme + weight,
               .subject = subject,
               .values = {scheme, weight},
               .status = "done",
               .reason = "",
               .metrics = {{"face.rms_mm", value}}};
  row.wall_s = wall_s;
  return row;
}

// The mean of scheme b is 1.5 at weight 1 and 2.5 at 10, that of a 4 and 5.
StudyResults Results() {
  StudyResults results{.title = "t",
                       .hash = "h",
                       .metric = "face.rms_mm",
                       .axes = {"interp", "weight"},
                       .trials = {},
                       .notes = {}};
  for (const auto& [subject, more] : {std::pair("s1", 0.0), std::pair("s2", 1.0)}) {
    results.trials.push_back(Trial(subject, "a", "1", 3.5 + more, 2));
    results.trials.push_back(Trial(subject, "a", "10", 4.5 + more, 4));
    results.trials.push_back(Trial(subject, "b", "1", 1 + more, NAN));
    results.trials.push_back(Trial(subject, "b", "10", 2 + more, 10));
  }
  return results;
}

TEST(StudyRanking, TheBestMeanComesFirst) {
  const std::string text = RankingText(Results());
  EXPECT_THAT(text, HasSubstr("face.rms_mm), best mean first; named by interp, weight:\n"));
  EXPECT_THAT(text, HasSubstr("   1         1.5  2 subjects  b, 1\n"));  // no time was told
  EXPECT_THAT(text, HasSubstr("   4           5  2 subjects, 4.0 s  a, 10\n"));
  StudyResults none = Results();
  none.metric = "another";
  EXPECT_EQ(RankingText(none), "");
}

TEST(StudyRanking, ALongRankingIsCutAndSaid) {
  StudyResults results = Results();
  for (int k = 0; k < 30; ++k) {
    results.trials.push_back(Trial("s1", "c", std::to_string(k), 100 + k, 1));
  }
  EXPECT_THAT(RankingText(results), HasSubstr("and 14 more in summary.csv"));
  EXPECT_THAT(RankingText(results), HasSubstr("1 subject, "));
}

TEST(StudyCharts, OnlyAxesOfNumbersArePlotted) {
  const StudyResults results = Results();
  const auto plots = AxisPlots(results, Ranked(results));
  ASSERT_THAT(plots, SizeIs(1));
  EXPECT_THAT(plots[0].alt, HasSubstr("weight"));
  EXPECT_THAT(plots[0].bytes, HasSubstr("<title>b, 1: 1.5</title>"));
  EXPECT_THAT(plots[0].bytes, HasSubstr("<title>a, 10: 5</title>"));
}

TEST(StudyCharts, EachCellOfTheMapLeadsToItsTrial) {
  const StudyResults results = Results();
  const auto ranked = Ranked(results);
  const auto map = SubjectMap(results, ranked);
  ASSERT_THAT(map, SizeIs(1));
  EXPECT_THAT(map[0].bytes, HasSubstr("<a href=\"#t-s2b10\">"));
  EXPECT_THAT(map[0].bytes, HasSubstr("b, 10 | s2: 3<"));
  EXPECT_THAT(SubjectMap(results, {ranked[0]}), SizeIs(0));
}

}  // namespace
}  // namespace semblance
