// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study_report/results_sqlite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

using ::testing::ElementsAre;
using testing::ScratchFolder;

StudyResults Results() {
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
    WriteFileAtomically(folder_ / "r.sqlite", ResultsSqlite(Results()));
    sqlite3_open((folder_ / "r.sqlite").c_str(), &database_);
  }
  ~SqliteTest() override { sqlite3_close(database_); }

  // Cells row by row; the error as the only cell.
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

TEST_F(SqliteTest, AnswersWhatTheResultsHold) {
  EXPECT_THAT(Ask("PRAGMA integrity_check"), ElementsAre("ok"));
  EXPECT_THAT(Ask("SELECT title, plan FROM study"), ElementsAre(Results().title, "abc"));
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

TEST(Sqlite, TheSameResultsGiveTheSameBytes) {
  EXPECT_EQ(ResultsSqlite(Results()), ResultsSqlite(Results()));
}

}  // namespace
}  // namespace semblance
