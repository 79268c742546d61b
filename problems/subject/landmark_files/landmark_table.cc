// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmark_files/landmark_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <set>
#include <utility>

#include "problems/subject/landmark_files/point_files.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
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
  bool Has(std::string_view name) const {
    return std::ranges::any_of(
        table_.Columns(), [&](const std::string& column) { return LowerCase(column) == name; });
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

// The columns of the coordinates, and the axes that their names state.
struct TableCoordinates {
  std::array<std::size_t, 3> xyz;
  std::string axes;
};

// Finds x, y, z, or Slicer's l, p, s or r, a, s. Fails if a table has two of the three.
TableCoordinates FindCoordinates(Columns& columns, const CsvReader& table) {
  std::vector<TableCoordinates> found;
  for (const auto& [names, axes] :
       {std::pair(std::array{"l", "p", "s"}, "LPS"), std::pair(std::array{"r", "a", "s"}, "RAS")}) {
    if (columns.Has(names[0]) && columns.Has(names[1]) && columns.Has(names[2])) {
      found.push_back(
          {{*columns.Find({names[0]}), *columns.Find({names[1]}), *columns.Find({names[2]})},
           axes});
    }
  }
  if (found.empty() || columns.Has("x") || columns.Has("x_mm")) {
    found.push_back(
        {{columns.Need({"x", "x_mm"}), columns.Need({"y", "y_mm"}), columns.Need({"z", "z_mm"})},
         ""});
  }
  if (found.size() > 1) {
    table.Fail("the columns hold the coordinates twice; keep x, y, z or l, p, s or r, a, s");
  }
  return found.front();
}

struct TableLayout {
  std::size_t site;
  TableCoordinates point;
  std::array<std::optional<std::size_t>, 3> normal;
  std::optional<std::size_t> depth_along_normal, depth_closest, certainty, note;
  std::optional<std::size_t> defined, missing, status, selected, visible;
};

TableLayout FindLayout(Columns& columns, const CsvReader& table) {
  return {.site = columns.Need({"site", "landmark", "label", "name"}),
          .point = FindCoordinates(columns, table),
          .normal = {columns.Find({"normal_x"}), columns.Find({"normal_y"}),
                     columns.Find({"normal_z"})},
          .depth_along_normal = columns.Find({"depth_along_normal_mm"}),
          .depth_closest = columns.Find({"depth_closest_mm"}),
          .certainty = columns.Find({"certainty"}),
          .note = columns.Find({"note", "description"}),
          .defined = columns.Find({"defined", "placed", "valid", "present"}),
          .missing = columns.Find({"missing", "absent", "undefined"}),
          .status = columns.Find({"position_status", "positionstatus", "position status"}),
          .selected = columns.Find({"selected"}),
          .visible = columns.Find({"visible"})};
}

std::vector<std::size_t> NumberColumns(const TableLayout& layout) {
  const auto& xyz = layout.point.xyz;
  std::vector<std::size_t> columns = {xyz[0], xyz[1], xyz[2]};
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
  const std::vector<std::size_t> numbers = NumberColumns(FindLayout(columns, table));
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
  CsvDialect dialect{.skips_empty_rows = true};
  if (first.find_first_of(";\t") != first.npos) {
    dialect.separator = first.find(';') != first.npos ? ';' : '\t';
    dialect.decimal = HasDecimalCommas(CsvReader(text, file, dialect)) ? ',' : '.';
  }
  return dialect;
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

// A cell of a column of yes and no; nothing if there is no such column or the cell is empty.
std::optional<bool> AnswerAt(const CsvReader& table, std::optional<std::size_t> column) {
  const std::string word = column ? LowerCase(std::string(table.Cell(*column))) : "";
  if (word == "1" || word == "true" || word == "yes") {
    return true;
  }
  if (word == "0" || word == "false" || word == "no") {
    return false;
  }
  if (!word.empty()) {
    table.Fail(fmt::format("column '{}': '{}' is neither 0 nor 1", table.Columns()[*column], word));
  }
  return std::nullopt;
}

// The reason why the site of a row has no point; empty if it has one.
std::string ReadAbsence(const CsvReader& table, const TableLayout& layout) {
  for (const auto& [column, absent_if] :
       {std::pair(layout.defined, false), std::pair(layout.missing, true)}) {
    if (const auto answer = AnswerAt(table, column); answer && *answer == absent_if) {
      return fmt::format("{} is {} in the table", table.Columns()[*column], absent_if ? 1 : 0);
    }
  }
  const std::string status = layout.status ? std::string(table.Cell(*layout.status)) : "";
  try {
    return status.empty() ? "" : AbsenceReason(status);
  } catch (const IoError& error) {
    table.Fail(error.what());
  }
}

Landmark ReadRow(const CsvReader& table, const TableLayout& layout) {
  const auto& xyz = layout.point.xyz;
  return {.site = std::string(table.Cell(layout.site)),
          .point = {table.Number(xyz[0]), table.Number(xyz[1]), table.Number(xyz[2])},
          .normal = NormalAt(table, layout),
          .depth_along_normal_mm = NumberAt(table, layout.depth_along_normal),
          .depth_closest_mm = NumberAt(table, layout.depth_closest),
          .certainty = CertaintyAt(table, layout.certainty),
          .doubt_mm = std::nullopt,
          .note = layout.note ? std::string(table.Cell(*layout.note)) : ""};
}

}  // namespace

LandmarkFile ParseLandmarkTable(std::string_view text, std::string_view file,
                                std::vector<std::string>& notes) {
  CsvReader table(text, file, DetectDialect(text, file));
  Columns columns(table);
  const TableLayout layout = FindLayout(columns, table);
  columns.Find({"locked"});  // concerns the mouse in Slicer
  if (const std::vector<std::string> ignored = columns.Unused(); !ignored.empty()) {
    notes.push_back(fmt::format("{}: ignored columns: {}", file, fmt::join(ignored, ", ")));
  }
  LandmarkFile result{
      .subject = "", .units = "mm", .axes = layout.point.axes, .landmarks = {}, .absent = {}};
  std::vector<std::string> hidden;
  while (table.NextRow()) {
    const std::string site(table.Cell(layout.site)), reason = ReadAbsence(table, layout);
    if (!reason.empty()) {
      result.absent.push_back({site, reason});
      continue;
    }
    result.landmarks.push_back(ReadRow(table, layout));
    if (AnswerAt(table, layout.selected) == false || AnswerAt(table, layout.visible) == false) {
      hidden.push_back(site);
    }
  }
  NoteHidden(file, hidden, notes);
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
