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

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

// Separator and decimal sign. In countries with a decimal comma, spreadsheets separate by
// semicolons.
struct CsvDialect {
  char separator = ',';  // also ';' or a tab
  char decimal = '.';
  bool skips_empty_rows = false;  // rows without any entry, which spreadsheets leave at the end
};

// Reads a table row by row. A cell may be quoted, with "" for a quote inside. Blanks around an
// unquoted cell are dropped, and so is a byte order mark. Every fault throws IoError "name:line:
// fault": repeated column names, a row whose cells do not match the columns, an unclosed quote, and
// the faults that the caller reports with Fail. The text must outlive the reader.
class CsvReader {
 public:
  // Reads the column names. name: the file's name, for messages.
  CsvReader(std::string_view text, std::string_view name, const CsvDialect& dialect = {});

  const std::vector<std::string>& Columns() const { return columns_; }
  // Index of the column, or nothing.
  std::optional<std::size_t> Find(std::string_view column) const;
  // Index of the column; fails if the column is missing.
  std::size_t RequireColumn(std::string_view column) const;

  // Reads the next row; false after the last one.
  bool NextRow();
  // A cell of the row; valid until the next call of NextRow.
  std::string_view Cell(std::size_t column) const { return cells_[column]; }
  // The finite decimal number in a cell; fails if the cell holds anything else.
  double Number(std::size_t column) const;
  // The same, but NaN if the cell is empty or holds "nan".
  double NumberOrNan(std::size_t column) const;

  // Throws IoError "name:line: what" for the line that was read last.
  [[noreturn]] void Fail(std::string_view what) const;

 private:
  void ReadCells();
  bool IsEmptyRow() const;
  std::string_view TakeQuoted();
  std::string_view TakePlain();
  std::optional<double> ToNumber(std::string_view text) const;

  std::string_view rest_;
  std::string name_;
  CsvDialect dialect_;
  int line_ = 0;       // line of the last row read
  int next_line_ = 1;  // line where rest_ begins
  std::vector<std::string> columns_;
  std::vector<std::string_view> cells_;
  std::deque<std::string> unquoted_;  // cells without their quotes
};

// Writes a table. Texts are quoted if necessary. Numbers have the fewest digits that read back to
// the same bits. A missing number, or one that is not finite, becomes an empty cell.
class CsvWriter {
 public:
  explicit CsvWriter(const std::vector<std::string>& columns);

  // Adds cells to the current row.
  template <class... Cells>
  CsvWriter& Add(const Cells&... cells) {
    (AddCell(cells), ...);
    return *this;
  }
  // Ends the row, which must have a cell for each column.
  void EndRow();

  // Writes one whole row.
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
  std::size_t cells_ = 0;  // cells in the row so far
};

}  // namespace semblance::surfaces
