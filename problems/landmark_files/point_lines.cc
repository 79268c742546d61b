// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/landmark_files/point_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"

namespace semblance {

std::string_view TrimBlanks(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t first = std::min(text.find_first_not_of(kBlanks), text.size());
  text.remove_prefix(first);
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

std::vector<std::string> SplitCells(std::string_view line, char separator) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t k = 0; k < line.size(); ++k) {
    if (line[k] == '"' && quoted && line.substr(k + 1, 1) == "\"") {
      cells.back() += line[++k];
    } else if (line[k] == '"') {
      quoted = !quoted;
    } else if (line[k] == separator && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += line[k];
    }
  }
  for (std::string& cell : cells) {
    cell = TrimBlanks(cell);
  }
  return cells;
}

PointLines::PointLines(std::string_view text, std::string_view file) : rest_(text), file_(file) {
  if (rest_.starts_with("\xEF\xBB\xBF")) {
    rest_.remove_prefix(3);  // what spreadsheets put before UTF-8
  }
}

bool PointLines::Next() {
  do {
    if (rest_.empty()) {
      return false;
    }
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line_ = TrimBlanks(rest_.substr(0, end));
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++number_;
  } while (line_.empty());
  return true;
}

double PointLines::Number(std::string_view cell) const {
  double value = kNaN;
  const std::string_view digits = cell.starts_with('+') ? cell.substr(1) : cell;
  const char* const last = digits.data() + digits.size();
  const auto [end, error] = std::from_chars(digits.data(), last, value);
  if (error != std::errc{} || end != last || !std::isfinite(value)) {
    Fail(fmt::format("'{}' is not a finite decimal number", cell));
  }
  return value;
}

void PointLines::Fail(std::string_view what) const {
  throw IoError(number_ > 0 ? fmt::format("{}:{}: {}", file_, number_, what)
                            : fmt::format("{}: {}", file_, what));
}

}  // namespace semblance
