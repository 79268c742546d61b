// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "surfaces/base/csv.h"

namespace semblance {
namespace {

constexpr std::array<std::string_view, 6> kNames = {"x", "y", "z", "u", "v", "weight"};
constexpr std::size_t kU = 3, kV = 4, kWeight = 5;

class PointReader {
 public:
  PointReader(std::string_view text, std::string_view name) : csv_(text, name) {}

  PointTable Read() {
    CheckColumns();
    while (csv_.NextRow()) {
      ReadPoint();
    }
    if (table_.positions.empty()) {
      csv_.Fail("no point follows the names of the columns; give at least one line of numbers");
    }
    return std::move(table_);
  }

 private:
  void CheckColumns() {
    for (const std::string& column : csv_.Columns()) {
      const auto at = std::find(kNames.begin(), kNames.end(), column);
      if (at == kNames.end()) {
        csv_.Fail(
            fmt::format("'{}' is no column; the first line names the columns, which are x, y, z "
                        "and, if wanted, u, v, weight",
                        column));
      }
    }
    for (std::size_t k = 0; k < kNames.size(); ++k) {
      columns_[k] = csv_.Find(kNames[k]);
    }
    for (const std::size_t k : {0, 1, 2}) {
      if (!columns_[k]) {
        csv_.Fail(fmt::format("there is no column '{}'; x, y and z are needed", kNames[k]));
      }
    }
    if (columns_[kU].has_value() != columns_[kV].has_value()) {
      csv_.Fail(fmt::format("the column '{}' stands alone; give u and v, or neither",
                            columns_[kU] ? "u" : "v"));
    }
  }

  void ReadPoint() {
    const auto number = [&](std::size_t k) { return csv_.Number(*columns_[k]); };
    table_.positions.emplace_back(number(0), number(1), number(2));
    if (columns_[kU]) {
      table_.uv.emplace_back(number(kU), number(kV));
    }
    if (columns_[kWeight]) {
      const double weight = number(kWeight);
      if (!(weight > 0)) {
        csv_.Fail(fmt::format("the weight is {}; it must be positive", weight));
      }
      table_.weights.push_back(weight);
    }
  }

  CsvReader csv_;
  std::array<std::optional<std::size_t>, kNames.size()> columns_;  // of the file, by kNames
  PointTable table_;
};

}  // namespace

PointTable ParsePointTable(std::string_view text, std::string_view name) {
  return PointReader(text, name).Read();
}

}  // namespace semblance
