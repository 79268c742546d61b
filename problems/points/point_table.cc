// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr std::array<std::string_view, 6> kNames = {"x", "y", "z", "u", "v", "weight"};
constexpr int kU = 3, kV = 4, kWeight = 5;

class PointReader {
 public:
  PointReader(std::string_view text, std::string_view name) : rest_(text), name_(name) {}

  PointTable Read() {
    if (rest_.substr(0, 3) == "\xEF\xBB\xBF") {
      rest_.remove_prefix(3);  // what spreadsheets put before UTF-8
    }
    ReadHeader(NextLine());
    while (!rest_.empty()) {
      ReadPoint(NextLine());
    }
    if (table_.positions.empty()) {
      Fail("no point follows the names of the columns; give at least one line of numbers");
    }
    return std::move(table_);
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw IoError(fmt::format("{}:{}: {}", name_, line_, what));
  }

  std::string_view NextLine() {
    ++line_;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    if (!line.empty() && line.back() == '\r') {
      line.remove_suffix(1);
    }
    return line;
  }

  // Takes the entry before the next comma away from the line, without blanks around it.
  static std::string_view NextEntry(std::string_view& line) {
    const std::size_t end = std::min(line.find(','), line.size());
    std::string_view entry = line.substr(0, end);
    line.remove_prefix(std::min(end + 1, line.size()));
    const std::size_t first = std::min(entry.find_first_not_of(" \t"), entry.size());
    entry.remove_prefix(first);
    while (!entry.empty() && (entry.back() == ' ' || entry.back() == '\t')) {
      entry.remove_suffix(1);
    }
    return entry;
  }

  void ReadHeader(std::string_view line) {
    const auto count = std::count(line.begin(), line.end(), ',') + 1;
    for (auto k = count; k > 0; --k) {
      const std::string_view entry = NextEntry(line);
      const auto at = std::find(kNames.begin(), kNames.end(), entry);
      const int column = static_cast<int>(at - kNames.begin());
      if (at == kNames.end()) {
        Fail(
            fmt::format("'{}' is no column; the first line names the columns, which are x, y, z "
                        "and, if wanted, u, v, weight",
                        entry));
      }
      if (Has(column)) {
        Fail(fmt::format("the column '{}' stands twice; leave one out", entry));
      }
      columns_.push_back(column);
    }
    for (const int column : {0, 1, 2}) {
      if (!Has(column)) {
        Fail(fmt::format("there is no column '{}'; x, y and z are needed", kNames[column]));
      }
    }
    if (Has(kU) != Has(kV)) {
      Fail(fmt::format("the column '{}' stands alone; give u and v, or neither",
                       Has(kU) ? "u" : "v"));
    }
  }

  bool Has(int column) const {
    return std::find(columns_.begin(), columns_.end(), column) != columns_.end();
  }

  void ReadPoint(std::string_view line) {
    if (line.empty()) {
      Fail("the line is empty; leave it out");
    }
    const auto count = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
    if (count != columns_.size()) {
      Fail(fmt::format("{} entries for {} columns; give one a column", count, columns_.size()));
    }
    std::array<double, 6> values{};
    for (const int column : columns_) {
      values[column] = Number(NextEntry(line), column);
    }
    table_.positions.emplace_back(values[0], values[1], values[2]);
    if (Has(kU)) {
      table_.uv.emplace_back(values[kU], values[kV]);
    }
    if (Has(kWeight)) {
      if (!(values[kWeight] > 0)) {
        Fail(fmt::format("the weight is {}; it must be positive", values[kWeight]));
      }
      table_.weights.push_back(values[kWeight]);
    }
  }

  double Number(std::string_view entry, int column) const {
    double value = kNaN;
    const char* const begin = entry.data() + (entry.substr(0, 1) == "+" ? 1 : 0);
    const auto [end, error] = std::from_chars(begin, entry.data() + entry.size(), value);
    if (error != std::errc{} || end != entry.data() + entry.size() || !std::isfinite(value)) {
      Fail(fmt::format("column '{}': '{}' is not a finite decimal number", kNames[column], entry));
    }
    return value;
  }

  std::string_view rest_;
  std::string_view name_;
  int line_ = 0;
  std::vector<int> columns_;  // what each column of the file is, as an index into kNames
  PointTable table_;
};

}  // namespace

PointTable ParsePointTable(std::string_view text, std::string_view name) {
  return PointReader(text, name).Read();
}

PointTable ReadPointTable(const std::filesystem::path& file) {
  return ParsePointTable(ReadFileBytes(file), file.string());
}

}  // namespace semblance
