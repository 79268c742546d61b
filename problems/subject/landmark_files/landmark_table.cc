// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmark_files/landmark_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <set>

#include "surfaces/base/csv.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

// Finds columns by name and remembers which were used.
class Columns {
 public:
  explicit Columns(const CsvReader& table) : table_(table) {}

  // The first column with one of the names; nothing if there is none.
  std::optional<std::size_t> Find(std::initializer_list<std::string_view> names) {
    for (std::size_t k = 0; k < table_.Columns().size(); ++k) {
      if (std::find(names.begin(), names.end(), LowerCase(table_.Columns()[k])) != names.end()) {
        used_.insert(k);
        return k;
      }
    }
    return std::nullopt;
  }
  std::size_t Need(std::initializer_list<std::string_view> names) {
    const auto found = Find(names);
    if (!found) {
      table_.Fail(fmt::format("there is no column {}; there are {}", fmt::join(names, " or "),
                              fmt::join(table_.Columns(), ", ")));
    }
    return *found;
  }
  std::vector<std::string> Unused() const {
    std::vector<std::string> names;
    for (std::size_t k = 0; k < table_.Columns().size(); ++k) {
      if (!used_.contains(k)) {
        names.push_back(table_.Columns()[k]);
      }
    }
    return names;
  }

 private:
  const CsvReader& table_;
  std::set<std::size_t> used_;
};

struct TableLayout {
  std::size_t site, x, y, z;
  std::array<std::optional<std::size_t>, 3> normal;
  std::optional<std::size_t> depth_along_normal, depth_closest, certainty, note;
};

TableLayout FindLayout(Columns& columns) {
  return {.site = columns.Need({"site", "landmark", "label", "name"}),
          .x = columns.Need({"x", "x_mm"}),
          .y = columns.Need({"y", "y_mm"}),
          .z = columns.Need({"z", "z_mm"}),
          .normal = {columns.Find({"normal_x"}), columns.Find({"normal_y"}),
                     columns.Find({"normal_z"})},
          .depth_along_normal = columns.Find({"depth_along_normal_mm"}),
          .depth_closest = columns.Find({"depth_closest_mm"}),
          .certainty = columns.Find({"certainty"}),
          .note = columns.Find({"note", "description"})};
}

std::vector<std::size_t> NumberColumns(const TableLayout& layout) {
  std::vector<std::size_t> columns = {layout.x, layout.y, layout.z};
  for (const auto& column : {layout.normal[0], layout.normal[1], layout.normal[2],
                             layout.depth_along_normal, layout.depth_closest}) {
    if (column) {
      columns.push_back(*column);
    }
  }
  return columns;
}

bool HasDecimalCommas(CsvReader table) {
  Columns columns(table);
  const std::vector<std::size_t> numbers = NumberColumns(FindLayout(columns));
  const auto has_comma = [&](std::size_t k) {
    return table.Cell(k).find(',') != std::string::npos;
  };
  while (table.NextRow()) {
    if (std::ranges::any_of(numbers, has_comma)) {
      return true;
    }
  }
  return false;
}

CsvDialect DetectDialect(std::string_view text, std::string_view file) {
  const std::string_view first = text.substr(0, text.find('\n'));
  if (first.find(';') == first.npos) {
    return {};
  }
  const CsvDialect points = {.separator = ';', .decimal = '.'};
  return HasDecimalCommas(CsvReader(text, file, points))
             ? CsvDialect{.separator = ';', .decimal = ','}
             : points;
}

std::optional<double> NumberAt(const CsvReader& table, std::optional<std::size_t> column) {
  const double value = column ? table.NumberOrNan(*column) : kNaN;
  return std::isnan(value) ? std::nullopt : std::optional(value);
}

std::optional<std::array<double, 3>> NormalAt(const CsvReader& table, const TableLayout& layout) {
  std::array<std::optional<double>, 3> n;
  std::transform(layout.normal.begin(), layout.normal.end(), n.begin(),
                 [&](const auto& column) { return NumberAt(table, column); });
  const auto given = std::count_if(n.begin(), n.end(), [](const auto& x) { return x.has_value(); });
  if (given != 0 && given != 3) {
    table.Fail("a normal must have normal_x, normal_y and normal_z, or none of them");
  }
  return given == 3 ? std::optional(std::array{*n[0], *n[1], *n[2]}) : std::nullopt;
}

Certainty CertaintyAt(const CsvReader& table, std::optional<std::size_t> column) {
  const std::string word = column ? LowerCase(std::string(table.Cell(*column))) : "";
  if (word.empty()) {
    return Certainty::kMedium;
  }
  const auto words = EnumNames(Certainty{});
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end()) {
    table.Fail(fmt::format("the certainty '{}' is not one of {}", word, fmt::join(words, ", ")));
  }
  return static_cast<Certainty>(found - words.begin());
}

Landmark ReadRow(const CsvReader& table, const TableLayout& layout) {
  return {.site = std::string(table.Cell(layout.site)),
          .point = {table.Number(layout.x), table.Number(layout.y), table.Number(layout.z)},
          .normal = NormalAt(table, layout),
          .depth_along_normal_mm = NumberAt(table, layout.depth_along_normal),
          .depth_closest_mm = NumberAt(table, layout.depth_closest),
          .certainty = CertaintyAt(table, layout.certainty),
          .note = layout.note ? std::string(table.Cell(*layout.note)) : ""};
}

}  // namespace

LandmarkFile ParseLandmarkTable(std::string_view text, std::string_view file,
                                std::vector<std::string>& ignored) {
  CsvReader table(text, file, DetectDialect(text, file));
  Columns columns(table);
  const TableLayout layout = FindLayout(columns);
  ignored = columns.Unused();
  LandmarkFile result{.subject = "", .units = "mm", .axes = "", .landmarks = {}, .absent = {}};
  while (table.NextRow()) {
    result.landmarks.push_back(ReadRow(table, layout));
  }
  return result;
}

std::string LandmarkTable(const LandmarkFile& file) {
  CsvWriter table({"site", "x_mm", "y_mm", "z_mm", "normal_x", "normal_y", "normal_z",
                   "depth_along_normal_mm", "depth_closest_mm", "certainty", "note"});
  for (const Landmark& l : file.landmarks) {
    const std::array<double, 3> normal = l.normal.value_or(std::array{kNaN, kNaN, kNaN});
    table.Row(l.site, l.point[0], l.point[1], l.point[2], normal[0], normal[1], normal[2],
              l.depth_along_normal_mm, l.depth_closest_mm,
              EnumNames(Certainty{})[static_cast<std::size_t>(l.certainty)], l.note);
  }
  return table.Text();
}

}  // namespace semblance::problems
