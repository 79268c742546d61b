// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/results_sqlite.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <memory>
#include <type_traits>

#include "surfaces/error.h"

namespace semblance {
namespace {

constexpr const char* kTables = R"sql(
CREATE TABLE study (title TEXT NOT NULL, plan TEXT NOT NULL, metric TEXT NOT NULL) STRICT;
CREATE TABLE axis (position INTEGER PRIMARY KEY, path TEXT NOT NULL UNIQUE) STRICT;
CREATE TABLE trial (id TEXT PRIMARY KEY, position INTEGER NOT NULL, subject TEXT NOT NULL,
  status TEXT NOT NULL, reason TEXT NOT NULL) STRICT;
CREATE TABLE setting (trial TEXT NOT NULL REFERENCES trial, axis INTEGER NOT NULL REFERENCES axis,
  value TEXT NOT NULL, PRIMARY KEY (trial, axis)) STRICT;
CREATE TABLE metric (trial TEXT NOT NULL REFERENCES trial, name TEXT NOT NULL,
  value REAL NOT NULL, PRIMARY KEY (trial, name)) STRICT;
)sql";

class Database {
 public:
  Database() { Check(sqlite3_open(":memory:", &database_)); }
  ~Database() { sqlite3_close_v2(database_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void Do(const char* sql) { Check(sqlite3_exec(database_, sql, nullptr, nullptr, nullptr)); }

  // One row; texts and numbers in the order of the table's columns.
  template <class... Values>
  void Insert(const char* table, const Values&... values) {
    std::string marks;
    ((marks += marks.empty() ? "?" : ", ?", static_cast<void>(values)), ...);
    const std::string sql = fmt::format("INSERT INTO {} VALUES ({})", table, marks);
    sqlite3_stmt* made = nullptr;
    Check(sqlite3_prepare_v2(database_, sql.c_str(), -1, &made, nullptr));
    const std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement(made,
                                                                               &sqlite3_finalize);
    int column = 0;
    (Bind(made, ++column, values), ...);
    Check(sqlite3_step(made) == SQLITE_DONE ? SQLITE_OK : SQLITE_ERROR);
  }

  std::string Bytes() const {
    sqlite3_int64 size = 0;
    const std::unique_ptr<unsigned char, decltype(&sqlite3_free)> bytes(
        sqlite3_serialize(database_, "main", &size, 0), &sqlite3_free);
    if (!bytes) {
      throw InputError("results.sqlite: SQLite ran out of memory; free some and merge again");
    }
    return {reinterpret_cast<const char*>(bytes.get()), static_cast<std::size_t>(size)};
  }

 private:
  void Bind(sqlite3_stmt* statement, int column, const std::string& text) {
    Check(sqlite3_bind_text(statement, column, text.data(), static_cast<int>(text.size()),
                            SQLITE_TRANSIENT));
  }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void Bind(sqlite3_stmt* statement, int column, Number number) {
    if constexpr (std::is_integral_v<Number>) {
      Check(sqlite3_bind_int64(statement, column, static_cast<sqlite3_int64>(number)));
    } else {
      Check(sqlite3_bind_double(statement, column, number));
    }
  }
  void Check(int code) const {
    if (code != SQLITE_OK) {
      throw InputError(fmt::format("results.sqlite: {}; check the study's plan.json and trials",
                                   database_ ? sqlite3_errmsg(database_) : "out of memory"));
    }
  }

  sqlite3* database_ = nullptr;
};

}  // namespace

std::string ResultsSqlite(const StudyResults& results) {
  Database database;
  database.Do("PRAGMA page_size = 4096");
  database.Do(kTables);
  database.Do("BEGIN");
  database.Insert("study", results.title, results.hash, results.metric);
  for (std::size_t k = 0; k < results.axes.size(); ++k) {
    database.Insert("axis", k, results.axes[k]);
  }
  for (std::size_t n = 0; n < results.trials.size(); ++n) {
    const TrialRow& row = results.trials[n];
    database.Insert("trial", row.id, n, row.subject, row.status, row.reason);
    for (std::size_t k = 0; k < row.values.size(); ++k) {
      database.Insert("setting", row.id, k, row.values[k]);
    }
    for (const auto& [name, value] : row.metrics) {
      database.Insert("metric", row.id, name, value);
    }
  }
  database.Do("COMMIT");
  return database.Bytes();
}

}  // namespace semblance
