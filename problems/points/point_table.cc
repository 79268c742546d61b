// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "surfaces/base/csv.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

constexpr std::array<std::string_view, kPointColumns> kNames = {
    "x", "y", "z", "u", "v", "weight", "sigma", "exact", "nx", "ny", "nz"};

// Column of the file for each PointColumn, then for each attribute.
using ColumnIndices = std::vector<std::optional<std::size_t>>;

const std::optional<std::size_t>& IndexOf(const ColumnIndices& indices, PointColumn column) {
  return indices[static_cast<std::size_t>(column)];
}

// Returns whether the columns nx, ny and nz are normals of exact points.
bool AreNormalsOfExact(const CsvReader& csv, FurtherColumns further) {
  return further == FurtherColumns::kOfScanners || csv.Find("exact").has_value();
}

void CheckPairs(const CsvReader& csv, const ColumnIndices& indices) {
  const bool u = IndexOf(indices, PointColumn::kU).has_value();
  if (u != IndexOf(indices, PointColumn::kV).has_value()) {
    csv.Fail(fmt::format("the column '{}' stands alone; give u and v, or neither", u ? "u" : "v"));
  }
  if (IndexOf(indices, PointColumn::kWeight) && IndexOf(indices, PointColumn::kSigma)) {
    csv.Fail("there are the columns 'weight' and 'sigma'; give one of them");
  }
  const auto normal = {IndexOf(indices, PointColumn::kNx).has_value(),
                       IndexOf(indices, PointColumn::kNy).has_value(),
                       IndexOf(indices, PointColumn::kNz).has_value()};
  const auto some = std::count(normal.begin(), normal.end(), true);
  if (some != 0 && (some != 3 || !IndexOf(indices, PointColumn::kExact))) {
    csv.Fail(
        "the columns nx, ny and nz are normals of exact points; give all three and 'exact', or "
        "none");
  }
}

// Returns whether scanners write a column of this name beside the coordinates.
bool IsOfScanners(const std::string& column) {
  static constexpr std::array<std::string_view, 15> kOfScanners = {
      "r",         "g",     "b",     "a",    "red",      "green", "blue",          "alpha",
      "intensity", "label", "class", "time", "gps_time", "range", "classification"};
  return std::ranges::find(kOfScanners, LowerCase(column)) != kOfScanners.end();
}

// Returns the names of the columns without effect. Refuses columns that nothing explains.
std::vector<std::string> FindFurther(const CsvReader& csv, const ColumnIndices& indices,
                                     FurtherColumns further) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < csv.Columns().size(); ++k) {
    const std::string& column = csv.Columns()[k];
    if (std::ranges::find(indices, std::optional(k)) != indices.end()) {
      continue;
    }
    if (further == FurtherColumns::kOfScanners && !IsOfScanners(column)) {
      csv.Fail(
          fmt::format("'{}' is not a column; the first line names the columns, which are x, y, z "
                      "and, if wanted, u, v, weight or sigma, exact, nx, ny, nz, and what the "
                      "option `attributes` names",
                      column));
    }
    names.push_back(column);
  }
  return names;
}

std::string FurtherNote(const std::vector<std::string>& names) {
  return names.empty() ? ""
                       : fmt::format(
                             "columns without effect: {0}; attributes: [{0}] fits numbers "
                             "in them over the surface",
                             fmt::join(names, ", "));
}

void AddNote(std::string note, PointTable& table) {
  if (!note.empty()) {
    table.notes.push_back(std::move(note));
  }
}

// The coordinate that a name of maps means; empty for other names.
std::string_view MapCoordinate(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kMapNames = {
      {{"lon", "x"},
       {"long", "x"},
       {"longitude", "x"},
       {"easting", "x"},
       {"east", "x"},
       {"lat", "y"},
       {"latitude", "y"},
       {"northing", "y"},
       {"north", "y"},
       {"depth", "z"},
       {"height", "z"},
       {"elevation", "z"},
       {"elev", "z"},
       {"altitude", "z"}}};
  const auto found =
      std::ranges::find(kMapNames, name, &std::pair<std::string_view, std::string_view>::first);
  return found == kMapNames.end() ? "" : found->second;
}

// The first line of a table, with the names that the reader knows.
struct FirstLineNames {
  std::string line;
  bool has_map_names = false, has_degrees = false;
};

// Calls use(begin, end, name) for each column of the line, with its name in small letters and
// without quotes, from the last column to the first.
template <class Use>
void ForEachName(std::string_view line, const Use& use) {
  for (std::size_t end = line.size(), begin = 0;; end = begin - 1) {
    const std::size_t comma = end == 0 ? line.npos : line.rfind(',', end - 1);
    begin = comma == line.npos ? 0 : comma + 1;
    const std::string small = LowerCase(std::string(line.substr(begin, end - begin)));
    const std::size_t first = small.find_first_not_of(" \t\r\"\xEF\xBB\xBF"),
                      last = small.find_last_not_of(" \t\r\"");
    if (first != small.npos && first <= last) {
      use(begin, end, small.substr(first, last + 1 - first));
    }
    if (begin == 0) {
      return;
    }
  }
}

// Writes the names of the columns that have a meaning in small letters, and those of maps as x, y
// and z.
FirstLineNames WithKnownNames(std::string_view first_line,
                              std::span<const std::string> attributes) {
  FirstLineNames names{std::string(first_line)};
  std::vector<std::string> taken(attributes.begin(), attributes.end());
  bool longitude = false, latitude = false;
  ForEachName(first_line,
              [&](std::size_t, std::size_t, const std::string& name) { taken.push_back(name); });
  ForEachName(first_line, [&](std::size_t begin, std::size_t end, const std::string& name) {
    const std::string coordinate(MapCoordinate(name));
    const auto is_taken = [&](std::string_view by) { return std::ranges::count(taken, by) > 0; };
    const bool is_attribute = std::ranges::find(attributes, name) != attributes.end();
    if (!coordinate.empty() && !is_attribute && !is_taken(coordinate)) {
      taken.push_back(coordinate);
      names.has_map_names = true;
      longitude = longitude || name.starts_with("lon");
      latitude = latitude || name.starts_with("lat");
      names.line.replace(begin, end - begin, coordinate);
    } else if (std::ranges::find(kNames, std::string_view(name)) != kNames.end()) {
      names.line.replace(begin, end - begin, name);
    }
  });
  names.has_degrees = longitude && latitude;
  return names;
}

// The columns of a table: their meanings, and the names of those without effect.
struct TableColumns {
  ColumnIndices indices;
  std::vector<std::string> further;
};

TableColumns ColumnsIn(const CsvReader& csv, std::span<const std::string> attributes,
                       FurtherColumns further) {
  ColumnIndices indices;
  for (const std::string_view name : kNames) {
    const bool is_other = name.starts_with('n') && !AreNormalsOfExact(csv, further);
    indices.push_back(is_other ? std::nullopt : csv.Find(name));
  }
  for (const std::string& attribute : attributes) {
    indices.push_back(csv.Find(attribute));
  }
  const std::vector<std::string> without_effect = FindFurther(csv, indices, further);
  for (const std::size_t k : {0, 1, 2}) {
    if (!indices[k]) {
      csv.Fail(fmt::format("there is no column '{}'; x, y and z are needed", kNames[k]));
    }
  }
  for (std::size_t k = 0; k < attributes.size(); ++k) {
    if (!indices[kPointColumns + k]) {
      csv.Fail(fmt::format("there is no column '{}', which the option `attributes` names",
                           attributes[k]));
    }
  }
  CheckPairs(csv, indices);
  return {std::move(indices), without_effect};
}

// Reads any allowed table, line by line.
class PointReader {
 public:
  PointReader(std::string_view text, std::string_view name, std::span<const std::string> attributes,
              FurtherColumns further)
      : csv_(text, name) {
    TableColumns columns = ColumnsIn(csv_, attributes, further);
    indices_ = std::move(columns.indices);
    AddNote(FurtherNote(columns.further), table_);
    for (const std::string& attribute : attributes) {
      table_.attributes.push_back({attribute, {}});
    }
    table_.weights_of_sigma = IndexOf(indices_, PointColumn::kSigma).has_value();
  }

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
    const auto number = [&](PointColumn column) { return csv_.Number(*IndexOf(indices_, column)); };
    table_.positions.emplace_back(number(PointColumn::kX), number(PointColumn::kY),
                                  number(PointColumn::kZ));
    if (IndexOf(indices_, PointColumn::kU)) {
      table_.uv.emplace_back(number(PointColumn::kU), number(PointColumn::kV));
    }
    for (const PointColumn column : {PointColumn::kWeight, PointColumn::kSigma}) {
      if (IndexOf(indices_, column)) {
        table_.weights.push_back(WeightOf(column));
      }
    }
    if (IndexOf(indices_, PointColumn::kExact)) {
      ReadExact();
    }
    for (std::size_t k = 0; k < table_.attributes.size(); ++k) {
      table_.attributes[k].values.push_back(csv_.Number(*indices_[kPointColumns + k]));
    }
  }

  void ReadExact() {
    const auto number = [&](PointColumn column) { return csv_.Number(*IndexOf(indices_, column)); };
    const double exact = number(PointColumn::kExact);
    if (exact != 0 && exact != 1) {
      csv_.Fail(
          fmt::format("exact is {}; write 1 for a point that must be met exactly, else 0", exact));
    }
    if (exact == 1) {
      const bool normal = IndexOf(indices_, PointColumn::kNx).has_value();
      AddExact(table_, table_.positions.size() - 1,
               normal ? Vec3(number(PointColumn::kNx), number(PointColumn::kNy),
                             number(PointColumn::kNz))
                      : Vec3::Zero());
    }
  }

  double WeightOf(PointColumn column) const {
    const double number = csv_.Number(*IndexOf(indices_, column));
    const double weight = column == PointColumn::kWeight ? number : 1 / (number * number);
    if (!(number > 0) || !std::isfinite(weight) || weight == 0) {
      csv_.Fail(fmt::format("the {} is {}; it must be positive{}",
                            kNames[static_cast<std::size_t>(column)], number,
                            number > 0 ? ", and 1 / sigma^2 a finite number above 0" : ""));
    }
    return weight;
  }

  CsvReader csv_;
  ColumnIndices indices_;
  PointTable table_;
};

}  // namespace

std::string PointName(const PointTable& table, std::size_t point) {
  const std::string name = fmt::format("point {}", point + 1);
  if (table.file.empty()) {
    return name;
  }
  return table.first_line == 0
             ? fmt::format("{}: {}", table.file, name)
             : fmt::format("{}:{}: {}", table.file,
                           static_cast<std::size_t>(table.first_line) + point, name);
}

void AddExact(PointTable& table, std::size_t point, const Vec3& normal) {
  table.exact.push_back(static_cast<std::uint32_t>(point));
  table.exact_normals.push_back(normal);
}

bool PointColumns::Has(PointColumn wanted) const {
  return std::find(kinds.begin(), kinds.end(), static_cast<std::size_t>(wanted)) != kinds.end();
}

PointColumns ReadPointColumns(std::string_view first_line, std::string_view name,
                              std::span<const std::string> attributes, FurtherColumns further) {
  const FirstLineNames names = WithKnownNames(first_line, attributes);
  const CsvReader csv(names.line, name);
  const TableColumns found = ColumnsIn(csv, attributes, further);
  PointColumns columns{.kinds = {},
                       .attributes = {attributes.begin(), attributes.end()},
                       .note = FurtherNote(found.further),
                       .has_map_names = names.has_map_names,
                       .has_degrees = names.has_degrees};
  columns.kinds.assign(csv.Columns().size(), columns.Kinds());
  for (std::size_t k = 0; k < found.indices.size(); ++k) {
    if (found.indices[k]) {
      columns.kinds[*found.indices[k]] = k;
    }
  }
  return columns;
}

// ------------------------------------------------------------- plain tables

namespace {

// Moves past the end of a line; returns false if something else follows.
bool TakeLineEnd(const char*& at, const char* end) {
  at += at + 1 < end && at[0] == '\r' && at[1] == '\n' ? 1 : 0;
  const bool ends = at == end || *at == '\n';
  at += at != end && ends ? 1 : 0;
  return ends;
}

}  // namespace

PlainPoints::PlainPoints(PointColumns columns)
    : columns_(std::move(columns)),
      has_uv_(columns_.Has(PointColumn::kU)),
      has_weight_(columns_.Has(PointColumn::kWeight)),
      has_sigma_(columns_.Has(PointColumn::kSigma)),
      has_exact_(columns_.Has(PointColumn::kExact)),
      values_(columns_.Kinds() + 1, 0.0) {
  table_.weights_of_sigma = has_sigma_;
  table_.has_map_columns = columns_.has_map_names;
  table_.has_degrees = columns_.has_degrees;
  AddNote(columns_.note, table_);
  for (const std::string& attribute : columns_.attributes) {
    table_.attributes.push_back({attribute, {}});
  }
}

void PlainPoints::Reserve(std::size_t count) {
  table_.positions.reserve(count);
  table_.uv.reserve(has_uv_ ? count : 0);
  table_.weights.reserve(has_weight_ || has_sigma_ ? count : 0);
  for (PointAttribute& attribute : table_.attributes) {
    attribute.values.reserve(count);
  }
}

bool PlainPoints::Add(std::string_view lines) {
  const char* at = lines.data();
  const char* const end = at + lines.size();
  while (at != end) {
    if (!AddLine(at, end)) {
      return false;
    }
  }
  return true;
}

bool PlainPoints::AddLine(const char*& at, const char* end) {
  for (std::size_t k = 0; k < columns_.kinds.size(); ++k) {
    if (k > 0 && (at == end || *at++ != ',')) {
      return false;
    }
    double& value = values_[columns_.kinds[k]];
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc{} || !std::isfinite(value)) {
      return false;
    }
    at = next;
  }
  return AddPoint() && TakeLineEnd(at, end);
}

bool PlainPoints::AddExactness() {
  const auto value = [&](PointColumn column) { return values_[static_cast<std::size_t>(column)]; };
  const double exact = value(PointColumn::kExact);
  if (exact == 1) {
    AddExact(table_, table_.positions.size() - 1,
             {value(PointColumn::kNx), value(PointColumn::kNy), value(PointColumn::kNz)});
  }
  return exact == 0 || exact == 1;
}

bool PlainPoints::AddPoint() {
  const auto value = [&](PointColumn column) { return values_[static_cast<std::size_t>(column)]; };
  table_.positions.emplace_back(value(PointColumn::kX), value(PointColumn::kY),
                                value(PointColumn::kZ));
  if (has_uv_) {
    table_.uv.emplace_back(value(PointColumn::kU), value(PointColumn::kV));
  }
  if (has_exact_ && !AddExactness()) {
    return false;
  }
  for (std::size_t k = 0; k < table_.attributes.size(); ++k) {
    table_.attributes[k].values.push_back(values_[kPointColumns + k]);
  }
  if (has_weight_ || has_sigma_) {
    const double sigma = value(PointColumn::kSigma),
                 weight = has_weight_ ? value(PointColumn::kWeight) : 1 / (sigma * sigma);
    table_.weights.push_back(weight);
    return weight > 0 && std::isfinite(weight) && (has_weight_ || sigma > 0);
  }
  return true;
}

PointTable ParsePointTable(std::string_view text, std::string_view name,
                           std::span<const std::string> attributes, FurtherColumns further) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view first_line = text.substr(0, end), rest = text.substr(end);
  PlainPoints plain(ReadPointColumns(first_line, name, attributes, further));
  if (!rest.empty() && plain.Add(rest.substr(1)) && plain.size() > 0) {
    return plain.Take();
  }
  FirstLineNames names = WithKnownNames(first_line, attributes);
  PointTable table = PointReader(names.line.append(rest), name, attributes, further).Read();
  table.has_map_columns = names.has_map_names;
  table.has_degrees = names.has_degrees;
  return table;
}

std::vector<Vec2> ParsePlaces(std::string_view text, std::string_view name) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  FirstLineNames names = WithKnownNames(text.substr(0, end), {});
  CsvReader csv(names.line.append(text.substr(end)), name);
  const std::size_t x = csv.RequireColumn("x"), y = csv.RequireColumn("y");
  std::vector<Vec2> places;
  while (csv.NextRow()) {
    places.emplace_back(csv.Number(x), csv.Number(y));
  }
  if (places.empty()) {
    csv.Fail("no place follows the names of the columns; give at least one line of numbers");
  }
  return places;
}

}  // namespace semblance::problems
