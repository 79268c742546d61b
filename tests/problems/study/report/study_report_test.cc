// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/study_sections.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cmath>
#include <sstream>
#include <tuple>

#include "problems/study/report/results_sqlite.h"
#include "problems/study/report/study_ranking.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ScratchFolder;
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

// The mean of scheme b is 1.5 at weight 1 and 2.5 at weight 10. The mean of a is 4 and 5.
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
  EXPECT_THAT(text, HasSubstr("   1         1.5  2 subjects  b, 1\n"));  // no time is known
  EXPECT_THAT(text, HasSubstr("   4           5  2 subjects, 4.0 s  a, 10\n"));
  StudyResults none = Results();
  none.metric = "another";
  EXPECT_EQ(RankingText(none), "no trial has the number 'another'; trials.csv lists all numbers\n");
}

// An unusable trial has the best value by far. No number changes because of it, and all tables
// count it.
TEST(StudyRanking, UnusableTrialsAreLeftOutAndCounted) {
  StudyResults results = Results();
  results.trials.push_back(Trial("s3", "a", "1", 0.001, 1));
  results.trials.back().status = "unusable";
  results.trials.back().reason = "the face is 28000 mm wide";
  EXPECT_THAT(RankingText(results), HasSubstr("   1         1.5  2 subjects  b, 1\n"));
  EXPECT_THAT(RankingText(results),
              HasSubstr("           4  2 subjects, 1 not usable, 2.0 s  a, 1\n"));
  EXPECT_EQ(UnusableText(Results()), "");
  EXPECT_EQ(
      UnusableText(results),
      "1 of 9 trials not usable and left out of rankings, means and tests: a, 1 (1). The table "
      "of trials has the reasons");
  EXPECT_THAT(SummaryCsv(results), HasSubstr("a,1,face.rms_mm,2,4,"));
  EXPECT_THAT(SummaryCsv(results), HasSubstr("mean_high_95,unusable,n_common,mean_common\n"));
  std::istringstream lines(SummaryCsv(results));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("a,1,") || line.starts_with("b,1,")) {
      EXPECT_THAT(line, HasSubstr(line.starts_with("a") ? ",,,1,2," : ",,,0,2,"));
    }
  }
}

TEST(StudyRanking, ALongRankingIsCutAndCounted) {
  StudyResults results = Results();
  for (int k = 0; k < 30; ++k) {
    results.trials.push_back(Trial("s1", "c", std::to_string(k), 100 + k, 1));
  }
  EXPECT_THAT(RankingText(results), HasSubstr("and 14 more in summary.csv"));
  EXPECT_THAT(RankingText(results), HasSubstr("1 subject, "));
}

TEST(StudyCharts, OnlyAxesOfNumbersArePlotted) {
  const StudyResults results = Results();
  const auto plots = AxisPlots(results, RankTreatments(results));
  ASSERT_THAT(plots, SizeIs(1));
  EXPECT_THAT(plots[0].alt, HasSubstr("weight"));
  EXPECT_THAT(plots[0].bytes, HasSubstr("<title>b, 1: 1.5</title>"));
  EXPECT_THAT(plots[0].bytes, HasSubstr("<title>a, 10: 5</title>"));
}

TEST(StudyCharts, EachCellOfTheMapLinksToItsTrial) {
  const StudyResults results = Results();
  const auto ranked = RankTreatments(results);
  const auto map = SubjectMap(results, ranked);
  ASSERT_THAT(map, SizeIs(1));
  EXPECT_THAT(map[0].bytes, HasSubstr("<a href=\"#t-s2b10\">"));
  EXPECT_THAT(map[0].bytes, HasSubstr("b, 10 | s2: 3<"));
  EXPECT_THAT(SubjectMap(results, {ranked[0]}), SizeIs(0));
}

// Two treatments of one subject. "wide" has the larger share and the larger error.
StudyResults TwoTreatments(bool higher) {
  StudyResults results{.title = "t",
                       .hash = "h",
                       .metric = higher ? "face.within_2_5mm" : "face.rms_mm",
                       .axes = {"interp"},
                       .trials = {},
                       .notes = {}};
  results.preference = PreferenceFor(results.metric);
  for (const auto& [label, share, rms] :
       {std::tuple("narrow", 0.5, 1.5), std::tuple("wide", 0.9, 2.5)}) {
    results.trials.push_back({.id = label,
                              .subject = "s",
                              .values = {label},
                              .status = "done",
                              .reason = "",
                              .metrics = {{"face.within_2_5mm", share},
                                          {"face.rms_mm", rms},
                                          {"face.regions.nose.within_2_5mm", share},
                                          {"face.regions.nose.rms_mm", rms}}});
  }
  return results;
}

TEST(StudySubtables, AMetricWithHigherBetterHasAColumnWithItsDirection) {
  const StudyResults results = TwoTreatments(true);
  const auto tables = Subtables(results, RankTreatments(results));
  ASSERT_EQ(tables.size(), 2u);
  EXPECT_THAT(tables[0].caption, HasSubstr("lower is better"));
  EXPECT_THAT(tables[0].header,
              ElementsAre("treatment", HasSubstr("higher is better"), "RMS (mm)"));
  EXPECT_THAT(tables[0].rows[0], ElementsAre("wide", "0.900", "2.500")) << "the best comes first";
  EXPECT_THAT(tables[1].caption, HasSubstr("higher is better"));
  EXPECT_THAT(tables[1].rows[0], ElementsAre("wide", "0.900"));
}

TEST(StudySubtables, AnErrorMetricHasOneColumn) {
  const StudyResults results = TwoTreatments(false);
  const auto tables = Subtables(results, RankTreatments(results));
  ASSERT_EQ(tables.size(), 2u);
  EXPECT_THAT(tables[0].header, ElementsAre("treatment", "RMS (mm)"));
  EXPECT_THAT(tables[0].rows[0], ElementsAre("narrow", "1.500"));
  EXPECT_THAT(tables[1].caption, Not(HasSubstr("better")));
}

StudyResults StoredResults() {
  StudyResults results;
  results.title = "Robert'); DROP TABLE trial;--";
  results.hash = "abc";
  results.metric = "face.rms_mm";
  results.axes = {"interp", "rounds"};
  results.trials = {{"t1", "a", {"mean", "1"}, "done", "", {{"face.rms_mm", 1.25}, {"n", 3}}},
                    {"t2", "a", {"nearest", "1"}, "done", "", {{"face.rms_mm", 2.5}}},
                    {"t3", "b", {"mean", "1"}, "failed", "no 'skull'", {}}};
  return results;
}

class SqliteTest : public ::testing::Test {
 protected:
  SqliteTest() {
    WriteFileAtomically(folder_ / "r.sqlite", ResultsSqlite(StoredResults()));
    sqlite3_open((folder_ / "r.sqlite").c_str(), &database_);
  }
  ~SqliteTest() override { sqlite3_close(database_); }

  // The cells row by row, or the error as the only cell.
  std::vector<std::string> Ask(const char* sql) {
    std::vector<std::string> cells;
    char* error = nullptr;
    const auto take = [](void* to, int count, char** values, char**) {
      for (int k = 0; k < count; ++k) {
        static_cast<std::vector<std::string>*>(to)->push_back(values[k] ? values[k] : "NULL");
      }
      return 0;
    };
    sqlite3_exec(database_, sql, take, &cells, &error);
    if (error) {
      cells = {error};
      sqlite3_free(error);
    }
    return cells;
  }

  ScratchFolder folder_;
  sqlite3* database_ = nullptr;
};

TEST_F(SqliteTest, HoldsTheResults) {
  EXPECT_THAT(Ask("PRAGMA integrity_check"), ElementsAre("ok"));
  EXPECT_THAT(Ask("SELECT title, plan FROM study"), ElementsAre(StoredResults().title, "abc"));
  EXPECT_THAT(Ask("SELECT s.value, m.value FROM trial t JOIN setting s ON s.trial = t.id "
                  "JOIN axis a ON a.position = s.axis JOIN metric m ON m.trial = t.id "
                  "WHERE a.path = 'interp' AND m.name = 'face.rms_mm' ORDER BY m.value"),
              ElementsAre("mean", "1.25", "nearest", "2.5"));
  EXPECT_THAT(Ask("SELECT subject, reason FROM trial WHERE status = 'failed'"),
              ElementsAre("b", "no 'skull'"));
  EXPECT_THAT(Ask("SELECT count(*) FROM metric WHERE trial = 't3'"), ElementsAre("0"));
}

TEST_F(SqliteTest, TablesAreStrict) {
  EXPECT_THAT(Ask("SELECT count(*) FROM pragma_table_list WHERE schema = 'main' AND strict = 1"),
              ElementsAre("6"));
  EXPECT_THAT(Ask("INSERT INTO metric VALUES ('t1', 'x', 'word')"),
              ElementsAre(::testing::HasSubstr("cannot store TEXT value in REAL column")));
}

TEST(Sqlite, SameResultsGiveSameBytes) {
  EXPECT_EQ(ResultsSqlite(StoredResults()), ResultsSqlite(StoredResults()));
}

}  // namespace
}  // namespace semblance::problems
