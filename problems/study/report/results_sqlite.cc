// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/results_sqlite.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <string>
#include <type_traits>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

constexpr const char* kTables = R"sql(
CREATE TABLE study (title TEXT NOT NULL, plan TEXT NOT NULL, metric TEXT NOT NULL) STRICT;
CREATE TABLE axis (position INTEGER PRIMARY KEY, path TEXT NOT NULL UNIQUE) STRICT;
CREATE TABLE trial (id TEXT PRIMARY KEY, position INTEGER NOT NULL, subject TEXT NOT NULL,
  status TEXT NOT NULL, reason TEXT NOT NULL) STRICT;
CREATE TABLE setting (trial TEXT NOT NULL REFERENCES trial, axis INTEGER NOT NULL REFERENCES axis,
  value TEXT NOT NULL, PRIMARY KEY (trial, axis)) STRICT, WITHOUT ROWID;
CREATE TABLE metric (trial TEXT NOT NULL REFERENCES trial, name TEXT NOT NULL,
  value REAL NOT NULL, PRIMARY KEY (trial, name)) STRICT, WITHOUT ROWID;
CREATE TABLE tag (word TEXT NOT NULL) STRICT;
)sql";

class Database {
 public:
  Database() { Check(sqlite3_open(":memory:", &database_)); }
  ~Database() { sqlite3_close_v2(database_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  sqlite3* get() const { return database_; }
  void Do(const char* sql) { Check(sqlite3_exec(database_, sql, nullptr, nullptr, nullptr)); }

  std::string Bytes() const {
    sqlite3_int64 size = 0;
    const std::unique_ptr<unsigned char, decltype(&sqlite3_free)> bytes(
        sqlite3_serialize(database_, "main", &size, 0), &sqlite3_free);
    if (!bytes) {
      throw InputError("results.sqlite: SQLite ran out of memory; free some and merge again");
    }
    return {reinterpret_cast<const char*>(bytes.get()), static_cast<std::size_t>(size)};
  }

  void Check(int code) const {
    if (code != SQLITE_OK) {
      throw InputError(fmt::format("results.sqlite: {}; check the study's plan.json and trials",
                                   database_ ? sqlite3_errmsg(database_) : "out of memory"));
    }
  }

  sqlite3* database_ = nullptr;
};

// Inserts rows into one table. The statement is compiled once, because a study has many rows.
class Inserter {
 public:
  Inserter(const Database& database, const char* table, int columns) : database_(database) {
    std::string marks = "?";
    for (int column = 1; column < columns; ++column) {
      marks += ", ?";
    }
    const std::string sql = fmt::format("INSERT INTO {} VALUES ({})", table, marks);
    sqlite3_stmt* made = nullptr;
    database.Check(sqlite3_prepare_v2(database.get(), sql.c_str(), -1, &made, nullptr));
    statement_.reset(made);
  }

  // Takes texts and numbers in the order of the table's columns.
  template <class... Values>
  void operator()(const Values&... values) {
    int column = 0;
    (Bind(++column, values), ...);
    database_.Check(sqlite3_step(statement_.get()) == SQLITE_DONE ? SQLITE_OK : SQLITE_ERROR);
    database_.Check(sqlite3_reset(statement_.get()));
  }

 private:
  void Bind(int column, const std::string& text) {
    database_.Check(sqlite3_bind_text(statement_.get(), column, text.data(),
                                      static_cast<int>(text.size()), SQLITE_STATIC));
  }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void Bind(int column, Number number) {
    if constexpr (std::is_integral_v<Number>) {
      database_.Check(
          sqlite3_bind_int64(statement_.get(), column, static_cast<sqlite3_int64>(number)));
    } else {
      database_.Check(sqlite3_bind_double(statement_.get(), column, number));
    }
  }

  const Database& database_;
  std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement_{nullptr, &sqlite3_finalize};
};

// Inserting in the order of the primary key is fastest.
std::vector<std::size_t> OrderById(const std::vector<TrialRow>& trials) {
  std::vector<std::size_t> order(trials.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {},
                           [&](std::size_t n) -> const std::string& { return trials[n].id; });
  return order;
}

void AddRows(const StudyResults& results, const Database& database) {
  Inserter study(database, "study", 3), axis(database, "axis", 2), trial(database, "trial", 5),
      setting(database, "setting", 3), metric(database, "metric", 3), tag(database, "tag", 1);
  study(results.title, results.hash, results.metric);
  for (const std::string& word : results.tags) {
    tag(word);
  }
  for (std::size_t k = 0; k < results.axes.size(); ++k) {
    axis(k, results.axes[k]);
  }
  for (std::size_t n = 0; n < results.trials.size(); ++n) {
    const TrialRow& row = results.trials[n];
    trial(row.id, n, row.subject, row.status, row.reason);
  }
  for (const std::size_t n : OrderById(results.trials)) {
    const TrialRow& row = results.trials[n];
    for (std::size_t k = 0; k < row.values.size(); ++k) {
      setting(row.id, k, row.values[k]);
    }
    for (const auto& [name, value] : row.metrics) {
      metric(row.id, name, value);
    }
  }
}

}  // namespace

std::string ResultsSqlite(const StudyResults& results) {
  Database database;
  database.Do("PRAGMA page_size = 4096");
  database.Do(kTables);
  database.Do("BEGIN");
  AddRows(results, database);
  database.Do("COMMIT");
  return database.Bytes();
}

}  // namespace semblance::problems
