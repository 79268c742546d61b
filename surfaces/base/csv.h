// SPDX-License-Identifier: GPL-3.0-or-later
// Tables as text: comma-separated values (RFC 4180), whose first line names the columns.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace semblance {

// How a table is written: in countries with a decimal comma, spreadsheets separate by semicolons.
struct CsvDialect {
  char separator = ',';
  char decimal = '.';
};

// Reads a table row by row. A cell may be quoted, with "" for a quote inside; blanks around a cell
// that is not quoted are dropped, and so is a byte order mark. Every fault is an IoError
// "name:line: what": columns of one name, a row with more or fewer cells than columns, a quote that
// does not end, and what Fail is called for. The text must outlive the reader.
class CsvReader {
 public:
  // name: of the file, for messages. Reads the names of the columns.
  CsvReader(std::string_view text, std::string_view name, const CsvDialect& dialect = {});

  const std::vector<std::string>& Columns() const { return columns_; }
  // The index of the column, or nothing.
  std::optional<std::size_t> Find(std::string_view column) const;
  // The index of the column; fails if there is none.
  std::size_t ColumnOf(std::string_view column) const;

  // Moves on to the next row; false after the last one.
  bool NextRow();
  // A cell of the row; valid until the next call of NextRow.
  std::string_view Cell(std::size_t column) const { return cells_[column]; }
  // The finite decimal number in a cell; fails if there is none.
  double Number(std::size_t column) const;
  // The same, or NaN where the cell is empty or says nan.
  double NumberOrNan(std::size_t column) const;

  // Throws IoError "name:line: what" for the row, or the names of the columns, that was read last.
  [[noreturn]] void Fail(std::string_view what) const;

 private:
  void ReadCells();
  std::string_view TakeQuoted();
  std::string_view TakePlain();
  std::optional<double> ToNumber(std::string_view text) const;

  std::string_view rest_;
  std::string name_;
  CsvDialect dialect_;
  int line_ = 0;       // of the row that was read last
  int next_line_ = 1;  // of what is left
  std::vector<std::string> columns_;
  std::vector<std::string_view> cells_;
  std::deque<std::string> unquoted_;  // cells whose quotes were taken off
};

// Writes a table. Texts are quoted where they must be. Numbers have the fewest digits that read
// back to the same bits; one that is not finite, or not there, is an empty cell.
class CsvWriter {
 public:
  explicit CsvWriter(const std::vector<std::string>& columns);

  // One row, or the beginning of one that further calls of Add continue.
  template <class... Cells>
  CsvWriter& Add(const Cells&... cells) {
    (AddCell(cells), ...);
    return *this;
  }
  // Ends the row, which must have a cell for each column.
  void EndRow();

  // One whole row.
  template <class... Cells>
  void Row(const Cells&... cells) {
    Add(cells...);
    EndRow();
  }

  const std::string& Text() const { return text_; }

 private:
  void AddText(std::string_view text);
  void AddNumber(double number);
  void AddCount(std::int64_t number);

  void AddCell(std::string_view text) { AddText(text); }
  void AddCell(std::floating_point auto number) { AddNumber(number); }
  void AddCell(std::integral auto number) { AddCount(static_cast<std::int64_t>(number)); }
  void AddCell(const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      AddText(text);
    }
  }
  template <class Value>
  void AddCell(const std::optional<Value>& value) {
    value ? AddCell(*value) : AddText("");
  }
  void Separate();

  std::string text_;
  std::size_t columns_ = 0;
  std::size_t cells_ = 0;  // of the row so far
};

}  // namespace semblance
