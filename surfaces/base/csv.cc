// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/csv.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <set>
#include <system_error>

#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"

namespace semblance::surfaces {
namespace {

constexpr std::string_view kBlanks = " \t";

std::string_view Trimmed(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(kBlanks), text.size());
  text.remove_prefix(first);
  const std::size_t last = text.find_last_not_of(kBlanks);
  return text.substr(0, last == text.npos ? 0 : last + 1);
}

}  // namespace

CsvReader::CsvReader(std::string_view text, std::string_view name, const CsvDialect& dialect)
    : rest_(text), name_(name), dialect_(dialect) {
  if (rest_.starts_with("\xEF\xBB\xBF")) {
    rest_.remove_prefix(3);  // the byte order mark that spreadsheets write
  }
  ReadCells();
  columns_.assign(cells_.begin(), cells_.end());
  std::set<std::string_view> seen;
  for (const std::string& column : columns_) {
    if (!seen.insert(column).second) {
      Fail(fmt::format("the column '{}' appears twice; leave one out", column));
    }
  }
}

std::optional<std::size_t> CsvReader::Find(std::string_view column) const {
  const auto at = std::find(columns_.begin(), columns_.end(), column);
  return at == columns_.end() ? std::nullopt
                              : std::optional(static_cast<std::size_t>(at - columns_.begin()));
}

std::size_t CsvReader::RequireColumn(std::string_view column) const {
  const auto found = Find(column);
  if (!found) {
    Fail(fmt::format("there is no column '{}'; there are {}", column, fmt::join(columns_, ", ")));
  }
  return *found;
}

bool CsvReader::IsEmptyRow() const {
  return std::all_of(cells_.begin(), cells_.end(), [](std::string_view c) { return c.empty(); });
}

bool CsvReader::NextRow() {
  do {
    if (rest_.empty()) {
      return false;
    }
    ReadCells();
  } while (dialect_.skips_empty_rows && IsEmptyRow());
  const bool is_empty = cells_.size() == 1 && cells_[0].empty();
  if (is_empty && columns_.size() > 1) {
    Fail("the line is empty; leave it out");
  }
  if (cells_.size() != columns_.size()) {
    Fail(fmt::format("{} entries for {} columns; give one entry per column", cells_.size(),
                     columns_.size()));
  }
  return true;
}

// Parses the whole of `text` as a number, or returns nothing. Accepts nan and inf.
std::optional<double> CsvReader::ToNumber(std::string_view text) const {
  std::string with_point;
  if (dialect_.decimal != '.') {
    with_point = text;
    std::replace(with_point.begin(), with_point.end(), '.',
                 '?');  // so that 1.000,5 is not a number
    std::replace(with_point.begin(), with_point.end(), dialect_.decimal, '.');
    text = with_point;
  }
  if (text.starts_with('+')) {  // from_chars rejects a plus sign
    text.remove_prefix(1);
  }
  double value = kNaN;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc{} && end == text.data() + text.size();
  return is_whole ? std::optional(value) : std::nullopt;
}

double CsvReader::Number(std::size_t column) const {
  const auto value = ToNumber(cells_[column]);
  if (!value || !std::isfinite(*value)) {
    Fail(fmt::format("column '{}': '{}' is not a finite decimal number", columns_[column],
                     cells_[column]));
  }
  return *value;
}

double CsvReader::NumberOrNan(std::size_t column) const {
  const auto value = cells_[column].empty() ? kNaN : ToNumber(cells_[column]);
  if (!value || std::isinf(*value)) {
    Fail(fmt::format("column '{}': '{}' is not a finite decimal number, nor nan or empty for none",
                     columns_[column], cells_[column]));
  }
  return *value;
}

void CsvReader::Fail(std::string_view what) const {
  throw IoError(fmt::format("{}:{}: {}", name_, line_, what));
}

void CsvReader::ReadCells() {
  line_ = next_line_;
  cells_.clear();
  unquoted_.clear();
  bool more = true;
  while (more) {
    const std::string_view blanks = dialect_.separator == '\t' ? " " : kBlanks;
    const std::size_t first = std::min(rest_.find_first_not_of(blanks), rest_.size());
    cells_.push_back(rest_.substr(first, 1) == "\"" ? TakeQuoted() : TakePlain());
    more = rest_.starts_with(dialect_.separator);
    rest_.remove_prefix(more ? 1 : 0);
  }
  rest_.remove_prefix(rest_.starts_with("\r\n") ? 2 : std::min<std::size_t>(1, rest_.size()));
  ++next_line_;
}

// Takes the text up to the next separator or the end of the line, which stay in rest_.
std::string_view CsvReader::TakePlain() {
  std::size_t end = 0;
  while (end < rest_.size() && rest_[end] != dialect_.separator && rest_[end] != '\n') {
    ++end;
  }
  std::string_view cell = rest_.substr(0, end);
  const bool is_last = end == rest_.size() || rest_[end] == '\n';
  if (is_last && cell.ends_with('\r')) {
    cell.remove_suffix(1);
  }
  rest_.remove_prefix(cell.size());
  return Trimmed(cell);
}

std::string_view CsvReader::TakeQuoted() {
  rest_.remove_prefix(rest_.find('"') + 1);
  std::string& cell = unquoted_.emplace_back();
  while (true) {
    const std::size_t quote = rest_.find('"');
    if (quote == rest_.npos) {
      Fail("a quote begins here and does not end; close it, or write \"\" for a quote in a text");
    }
    cell += rest_.substr(0, quote);
    rest_.remove_prefix(quote + 1);
    if (!rest_.starts_with('"')) {
      break;
    }
    cell += '"';
    rest_.remove_prefix(1);
  }
  next_line_ += static_cast<int>(std::count(cell.begin(), cell.end(), '\n'));
  if (!TakePlain().empty()) {
    Fail("text follows a closing quote; quote the whole entry");
  }
  return cell;
}

CsvWriter::CsvWriter(const std::vector<std::string>& columns) : columns_(columns.size()) {
  Row(columns);
}

void CsvWriter::Separate() {
  if (cells_ > 0) {
    text_ += ',';
  }
  ++cells_;
}

void CsvWriter::AddNumber(double number) {
  Separate();
  if (std::isfinite(number)) {
    std::array<char, 32> digits;  // a double needs at most 24
    text_.append(digits.data(), fmt::format_to(digits.data(), "{}", number));
  }
}

void CsvWriter::AddCount(std::int64_t number) {
  Separate();
  text_ += std::to_string(number);
}

void CsvWriter::AddText(std::string_view text) {
  Separate();
  const bool is_padded = Trimmed(text).size() != text.size();
  if (!is_padded && text.find_first_of(",\"\r\n") == text.npos) {
    text_ += text;
    return;
  }
  text_ += '"';
  for (const char c : text) {
    text_.append(c == '"' ? 2 : 1, c);
  }
  text_ += '"';
}

void CsvWriter::EndRow() {
  assert(cells_ == columns_);
  cells_ = 0;
  text_ += '\n';
}

}  // namespace semblance::surfaces
