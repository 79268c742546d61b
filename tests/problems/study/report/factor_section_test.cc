// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/factor_section.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "problems/study/report/study_factors.h"
#include "problems/study/report/study_ranking.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

// The part of each treatment's value that does not depend on the subject.
double Effect(const std::string& scheme, const std::string& markers) {
  const double base = markers == "all" ? 1 : markers == "spread n=16" ? 2 : 4;
  return scheme == "kriging" ? base : base + 3;
}

// 2 schemes x 3 numbers of markers. Subject s adds s to each value, and a little of its own.
StudyResults Results(int subjects) {
  StudyResults results{.title = "t",
                       .hash = "h",
                       .metric = "face.rms_mm",
                       .axes = {"interp", "landmarks.keep"},
                       .trials = {},
                       .notes = {}};
  for (int s = 0; s < subjects; ++s) {
    int k = 0;
    for (const std::string scheme : {"kriging", "nearest"}) {
      for (const std::string markers : {"all", "spread n=8", "spread n=16"}) {
        const double value = Effect(scheme, markers) + s + 0.01 * std::sin(7.0 * s + 3.0 * ++k);
        results.trials.push_back({.id = fmt::format("{}{}{}", s, scheme, markers),
                                  .subject = fmt::format("s{}", s),
                                  .values = {scheme, markers},
                                  .status = "done",
                                  .reason = "",
                                  .metrics = {{"face.rms_mm", value}}});
      }
    }
  }
  return results;
}

TEST(StudyFactors, NumbersWithinWordsAreOrdered) {
  const StudyFactor factor = OrderLevels("k", {"all", "spread n=16", "spread n=8", "none"});
  EXPECT_TRUE(factor.is_ordered);
  EXPECT_THAT(factor.levels, ElementsAre("none", "spread n=8", "spread n=16", "all"));
  EXPECT_THAT(factor.positions, ElementsAre(0, 1, 2, 3));
  const StudyFactor numbers = OrderLevels("n", {"10", "0.5", "2"});
  EXPECT_THAT(numbers.levels, ElementsAre("0.5", "2", "10"));
  EXPECT_THAT(numbers.positions, ElementsAre(0.5, 2, 10));
}

TEST(StudyFactors, OtherWordsKeepTheirOrder) {
  for (const auto& levels : std::vector<std::vector<std::string>>{
           {"nearest", "kriging"}, {"a 1 2", "a 2 1"}, {"a 1", "b 2"}, {"all", "spread n=8"}}) {
    const StudyFactor factor = OrderLevels("k", levels);
    EXPECT_FALSE(factor.is_ordered) << levels[0];
    EXPECT_EQ(factor.levels, levels);
  }
}

TEST(StudyFactors, OnlySubjectsWithEveryCombinationAreUsed) {
  StudyResults results = Results(7);
  results.trials[8].status = "failed";  // of s1
  const FactorGrid grid = FindFactorGrid(results);
  ASSERT_THAT(grid.factors, SizeIs(2));
  EXPECT_THAT(grid.factors[1].levels, ElementsAre("spread n=8", "spread n=16", "all"));
  EXPECT_THAT(grid.subjects, SizeIs(6));
  EXPECT_THAT(grid.left_out, ElementsAre("s1"));
  EXPECT_NEAR(grid.values.subject[0][0], 4, 0.011);  // s0, kriging, spread n=8
  EXPECT_NEAR(grid.values.subject[0][5], 4, 0.011);  // s0, nearest, all
}

TEST(StudyFactors, AxesThatChangeTogetherAreOneFactor) {
  StudyResults results = Results(2);
  results.axes = {"title", "interp", "landmarks.keep", "twin"};
  for (TrialRow& row : results.trials) {
    row.values = {row.values[0] + row.values[1], row.values[0], row.values[1],
                  "with " + row.values[1]};
  }
  const FactorGrid grid = FindFactorGrid(results);
  ASSERT_THAT(grid.factors, SizeIs(2));
  EXPECT_EQ(grid.factors[0].name, "interp");
  EXPECT_EQ(grid.factors[1].name, "landmarks.keep");
}

TEST(StudyFactors, AnUnbalancedGridIsRefusedWithItsReason) {
  StudyResults results = Results(6);
  std::erase_if(results.trials, [](const TrialRow& row) {
    return row.values == std::vector<std::string>{"nearest", "all"};
  });
  const FactorGrid grid = FindFactorGrid(results);
  EXPECT_THAT(grid.factors, IsEmpty());
  EXPECT_THAT(grid.complaint, HasSubstr("5 treatments are not every combination"));
  const auto sections = FactorSections(results, grid);
  ASSERT_THAT(sections, SizeIs(1));
  EXPECT_THAT(sections[0].paragraphs, ElementsAre(grid.complaint));
  EXPECT_THAT(sections[0].tables, IsEmpty());
}

TEST(StudyFactors, ATreatmentWithoutValuesIsNamed) {
  StudyResults results = Results(6);
  for (TrialRow& row : results.trials) {
    row.status = row.values[0] == "nearest" && row.values[1] == "all" ? "failed" : "done";
  }
  EXPECT_THAT(FindFactorGrid(results).complaint, HasSubstr("nearest, all has no value"));
}

TEST(FactorSection, ThePivotTableHasTheMeansAndTheirMargins) {
  const StudyResults results = Results(7);
  const auto sections = FactorSections(results, FindFactorGrid(results));
  ASSERT_THAT(sections, SizeIs(2));
  const ReportTable& pivot = sections[1].tables[0];
  EXPECT_THAT(pivot.header, ElementsAre("interp", "spread n=8", "spread n=16", "all", "mean"));
  ASSERT_THAT(pivot.rows, SizeIs(3));
  const auto number = [&](std::size_t row, std::size_t column) {
    return std::stod(pivot.rows[row][column]);
  };
  EXPECT_NEAR(number(0, 1), 3 + 4, 0.01);  // the mean subject adds 3
  EXPECT_NEAR(number(1, 3), 3 + 4, 0.01);
  EXPECT_NEAR(number(0, 4), 3 + 7.0 / 3, 0.01);
  EXPECT_NEAR(number(2, 2), 3 + 3.5, 0.01);
  EXPECT_NEAR(number(2, 4), 3 + 7.0 / 3 + 1.5, 0.01);
}

TEST(FactorSection, TheTableHasEffectsAndTests) {
  const StudyResults results = Results(7);
  const auto sections = FactorSections(results, FindFactorGrid(results));
  EXPECT_THAT(sections[0].paragraphs[0],
              HasSubstr("7 subjects have a value for every combination"));
  EXPECT_THAT(sections[0].images, SizeIs(3));
  const ReportTable& effects = sections[0].tables[0];
  ASSERT_THAT(effects.rows, SizeIs(4));
  EXPECT_EQ(effects.rows[0][0], "interp");
  EXPECT_EQ(effects.rows[0][2], "nearest minus kriging");
  EXPECT_NEAR(std::stod(effects.rows[0][3]), 3, 0.01);
  EXPECT_EQ(effects.rows[1][2], "spread n=8 minus all");
  EXPECT_EQ(effects.rows[2][0], "interp x landmarks.keep");
  double share = 0;
  for (const auto& row : effects.rows) {
    share += std::stod(row[1]);
  }
  EXPECT_NEAR(share, 100, 0.2);
  EXPECT_NEAR(std::stod(effects.rows[0][5]), 1.0 / 64, 1e-4) << "seven subjects, two levels";
}

TEST(FactorSection, BelowSixSubjectsThereIsNoTest) {
  const StudyResults results = Results(5);
  const auto sections = FactorSections(results, FindFactorGrid(results));
  ASSERT_THAT(sections, SizeIs(2));
  const ReportTable& effects = sections[0].tables[0];
  EXPECT_THAT(effects.caption, HasSubstr("at least 6 subjects"));
  for (const auto& row : effects.rows) {
    EXPECT_EQ(row[5] + row[6], "");
  }
}

TEST(FactorSection, WithoutACompleteSubjectNothingIsCompared) {
  StudyResults results = Results(6);
  for (std::size_t n = 0; n < results.trials.size(); n += 7) {  // another treatment of each subject
    results.trials[n].status = "missing";
  }
  const auto sections = FactorSections(results, FindFactorGrid(results));
  ASSERT_THAT(sections, SizeIs(1));
  EXPECT_THAT(sections[0].paragraphs[0], HasSubstr("No subject has a value for every combination"));
  EXPECT_THAT(sections[0].images, IsEmpty());
}

// Three factors make small multiples.
TEST(FactorSection, AThirdFactorMakesPanels) {
  StudyResults results = Results(6);
  results.axes.emplace_back("emitter");
  const std::vector<TrialRow> before = results.trials;
  results.trials.clear();
  for (const std::string emitter : {"flat", "split"}) {
    for (TrialRow row : before) {
      row.id += emitter;
      row.values.push_back(emitter);
      row.metrics["face.rms_mm"] += emitter == "flat" ? 0 : 0.5;
      results.trials.push_back(row);
    }
  }
  const auto sections = FactorSections(results, FindFactorGrid(results));
  ASSERT_THAT(sections, SizeIs(2));
  EXPECT_THAT(sections[0].images, SizeIs(2)) << "no heat map";
  EXPECT_THAT(sections[0].images[0].bytes,
              AllOf(HasSubstr(">emitter = flat<"), HasSubstr(">emitter = split<")));
  EXPECT_THAT(sections[0].tables[0].rows, SizeIs(7)) << "three effects, three interactions, rest";
  EXPECT_THAT(sections[1].tables[0].rows, SizeIs(5)) << "four combinations and the mean";
}

TEST(FactorSection, OneOrderedAxisIsALineAndOneOfWordsIsNothing) {
  StudyResults results = Results(6);
  std::erase_if(results.trials, [](const TrialRow& row) { return row.values[0] == "nearest"; });
  const auto sections = FactorSections(results, FindFactorGrid(results));
  ASSERT_THAT(sections, SizeIs(1));
  EXPECT_THAT(sections[0].images[0].bytes, HasSubstr("spread n=8: 6.5"));
  StudyResults words = Results(6);
  std::erase_if(words.trials, [](const TrialRow& row) { return row.values[1] != "all"; });
  EXPECT_THAT(FactorSections(words, FindFactorGrid(words)), IsEmpty());
}

// The best treatment lacks the subject that is the worst for all others: its mean over its own
// subjects is the smallest, over the common ones the largest.
TEST(CommonSubjects, AMissingTrialDoesNotMakeATreatmentBetter) {
  StudyResults results{.title = "t",
                       .hash = "h",
                       .metric = "face.rms_mm",
                       .axes = {"interp"},
                       .trials = {},
                       .notes = {}};
  for (int s = 0; s < 4; ++s) {
    for (const std::string scheme : {"a", "b"}) {
      if (s < 3 || scheme == "a") {
        const double value = (s == 3 ? 100 : 1) + (scheme == "a" ? 0.0 : 0.5);
        results.trials.push_back({.id = fmt::format("{}{}", s, scheme),
                                  .subject = fmt::format("s{}", s),
                                  .values = {scheme},
                                  .status = "done",
                                  .reason = "",
                                  .metrics = {{"face.rms_mm", value}}});
      }
    }
  }
  const std::vector<Treatment> ranked = RankTreatments(results);
  EXPECT_EQ(ranked[0].label, "a");
  EXPECT_THAT(ranked[0].by_subject, SizeIs(4));
  const std::vector<Treatment> compared = RestrictToCommonSubjects(results, ranked);
  EXPECT_THAT(compared[0].by_subject, SizeIs(3));
  EXPECT_THAT(compared[0].trials, SizeIs(3));
  EXPECT_DOUBLE_EQ(MeanOverSubjects(compared[0]), 1);
  EXPECT_THAT(RankingText(results),
              AllOf(HasSubstr("           1  3 subjects  a\n"),
                    HasSubstr("compared over the 3 subjects that all of them have. Not all of them "
                              "have: s3.")));
  EXPECT_THAT(SummaryCsv(results), AllOf(HasSubstr("a,face.rms_mm,4,25.75,"), HasSubstr(",0,3,1\n"),
                                         HasSubstr(",0,3,1.5\n")));
}

TEST(CommonSubjects, ATreatmentWithFewSubjectsDoesNotTakeThemFromTheOthers) {
  StudyResults results = Results(6);
  for (TrialRow& row : results.trials) {
    if (row.values[0] == "kriging" && row.values[1] == "all" && row.subject != "s0") {
      row.status = "failed";
    }
  }
  const std::vector<Treatment> ranked = RankTreatments(results);
  EXPECT_EQ(ranked.back().label, "kriging, all") << "it is the best, but of one subject alone";
  EXPECT_THAT(RestrictToCommonSubjects(results, ranked)[0].by_subject, SizeIs(6));
  EXPECT_THAT(CommonSubjectsText(ranked), HasSubstr("Not ranked, because fewer than half of the "
                                                    "subjects have a value: kriging, all."));
}

TEST(CommonSubjects, DisjointSubjectsAreNotCompared) {
  StudyResults results = Results(2);
  for (TrialRow& row : results.trials) {
    row.status = (row.values[0] == "kriging") == (row.subject == "s0") ? "done" : "missing";
  }
  const std::vector<Treatment> ranked = RankTreatments(results);
  EXPECT_THAT(CommonSubjectsText(ranked), HasSubstr("is not a comparison"));
  EXPECT_EQ(CommonSubjectsText(RankTreatments(Results(2))), "");
}

TEST(WideCsv, HasOneRowPerTrialAndAColumnPerMetric) {
  StudyResults results = Results(1);
  results.trials.resize(3);
  results.trials[0].metrics = {{"a.x", 1}, {"c", 3}};
  results.trials[1].metrics = {{"b", 2.5}};
  results.trials[2].metrics.clear();
  results.trials[2].status = "failed";
  results.trials[2].reason = "no skull, no face";
  EXPECT_EQ(TrialsWideCsv(results),
            "trial,subject,interp,landmarks.keep,status,reason,a.x,b,c\n"
            "0krigingall,s0,kriging,all,done,,1,,3\n"
            "0krigingspread n=8,s0,kriging,spread n=8,done,,,2.5,\n"
            "0krigingspread n=16,s0,kriging,spread n=16,failed,\"no skull, no face\",,,\n");
}

}  // namespace
}  // namespace semblance::problems
