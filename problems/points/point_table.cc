// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "problems/points/plain_points.h"
#include "surfaces/base/csv.h"

namespace semblance {
namespace {

constexpr std::array<std::string_view, kPointColumns> kNames = {"x", "y", "z", "u", "v", "weight"};

// Of the file, by kNames.
using ColumnPlaces = std::array<std::optional<std::size_t>, kPointColumns>;

// In `places` or not.
const std::optional<std::size_t>& PlaceOf(const ColumnPlaces& places, PointColumn column) {
  return places[static_cast<std::size_t>(column)];
}

ColumnPlaces PlacesIn(const CsvReader& csv) {
  for (const std::string& column : csv.Columns()) {
    if (std::find(kNames.begin(), kNames.end(), column) == kNames.end()) {
      csv.Fail(
          fmt::format("'{}' is no column; the first line names the columns, which are x, y, z "
                      "and, if wanted, u, v, weight",
                      column));
    }
  }
  ColumnPlaces places;
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    places[k] = csv.Find(kNames[k]);
  }
  for (const std::size_t k : {0, 1, 2}) {
    if (!places[k]) {
      csv.Fail(fmt::format("there is no column '{}'; x, y and z are needed", kNames[k]));
    }
  }
  const bool u = PlaceOf(places, PointColumn::kU).has_value();
  if (u != PlaceOf(places, PointColumn::kV).has_value()) {
    csv.Fail(fmt::format("the column '{}' stands alone; give u and v, or neither", u ? "u" : "v"));
  }
  return places;
}

// Any table that may be, line by line.
class PointReader {
 public:
  PointReader(std::string_view text, std::string_view name)
      : csv_(text, name), places_(PlacesIn(csv_)) {}

  PointTable Read() {
    while (csv_.NextRow()) {
      ReadPoint();
    }
    if (table_.positions.empty()) {
      csv_.Fail("no point follows the names of the columns; give at least one line of numbers");
    }
    return std::move(table_);
  }

 private:
  void ReadPoint() {
    const auto number = [&](PointColumn column) { return csv_.Number(*PlaceOf(places_, column)); };
    table_.positions.emplace_back(number(PointColumn::kX), number(PointColumn::kY),
                                  number(PointColumn::kZ));
    if (PlaceOf(places_, PointColumn::kU)) {
      table_.uv.emplace_back(number(PointColumn::kU), number(PointColumn::kV));
    }
    if (PlaceOf(places_, PointColumn::kWeight)) {
      const double weight = number(PointColumn::kWeight);
      if (!(weight > 0)) {
        csv_.Fail(fmt::format("the weight is {}; it must be positive", weight));
      }
      table_.weights.push_back(weight);
    }
  }

  CsvReader csv_;
  ColumnPlaces places_;
  PointTable table_;
};

}  // namespace

std::vector<PointColumn> PointColumnsOf(std::string_view first_line, std::string_view name) {
  const CsvReader csv(first_line, name);
  const ColumnPlaces places = PlacesIn(csv);
  std::vector<PointColumn> columns(csv.Columns().size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (places[k]) {
      columns[*places[k]] = static_cast<PointColumn>(k);
    }
  }
  return columns;
}

PointTable ParsePointTable(std::string_view text, std::string_view name) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  PlainPoints plain(PointColumnsOf(text.substr(0, end), name));
  const bool is_plain = end < text.size() && plain.Add(text.substr(end + 1)) && plain.size() > 0;
  return is_plain ? plain.Take() : PointReader(text, name).Read();
}

}  // namespace semblance
