// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_table.h"

#include <fmt/format.h>

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

namespace semblance::problems {
namespace {

constexpr std::array<std::string_view, kPointColumns> kNames = {
    "x", "y", "z", "u", "v", "weight", "sigma", "exact", "nx", "ny", "nz"};

// Column of the file for each PointColumn, then for each attribute.
using ColumnIndices = std::vector<std::optional<std::size_t>>;

const std::optional<std::size_t>& IndexOf(const ColumnIndices& indices, PointColumn column) {
  return indices[static_cast<std::size_t>(column)];
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

// Refuses columns that are neither PointColumns nor attributes.
void CheckNames(const CsvReader& csv, std::span<const std::string> attributes) {
  for (const std::string& column : csv.Columns()) {
    if (std::find(kNames.begin(), kNames.end(), column) == kNames.end() &&
        std::find(attributes.begin(), attributes.end(), column) == attributes.end()) {
      csv.Fail(
          fmt::format("'{}' is not a column; the first line names the columns, which are x, y, z "
                      "and, if wanted, u, v, weight or sigma, exact, nx, ny, nz, and what the "
                      "option `attributes` names",
                      column));
    }
  }
}

ColumnIndices IndicesIn(const CsvReader& csv, std::span<const std::string> attributes) {
  CheckNames(csv, attributes);
  ColumnIndices indices;
  for (const std::string_view name : kNames) {
    indices.push_back(csv.Find(name));
  }
  for (const std::size_t k : {0, 1, 2}) {
    if (!indices[k]) {
      csv.Fail(fmt::format("there is no column '{}'; x, y and z are needed", kNames[k]));
    }
  }
  for (const std::string& attribute : attributes) {
    indices.push_back(csv.Find(attribute));
    if (!indices.back()) {
      csv.Fail(
          fmt::format("there is no column '{}', which the option `attributes` names", attribute));
    }
  }
  CheckPairs(csv, indices);
  return indices;
}

// Reads any allowed table, line by line.
class PointReader {
 public:
  PointReader(std::string_view text, std::string_view name, std::span<const std::string> attributes)
      : csv_(text, name), indices_(IndicesIn(csv_, attributes)) {
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
                              std::span<const std::string> attributes) {
  const CsvReader csv(first_line, name);
  const ColumnIndices indices = IndicesIn(csv, attributes);
  PointColumns columns{.kinds = std::vector<std::size_t>(csv.Columns().size()),
                       .attributes = {attributes.begin(), attributes.end()}};
  for (std::size_t k = 0; k < indices.size(); ++k) {
    if (indices[k]) {
      columns.kinds[*indices[k]] = k;
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
      values_(columns_.Kinds(), 0.0) {
  table_.weights_of_sigma = has_sigma_;
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
                           std::span<const std::string> attributes) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  PlainPoints plain(ReadPointColumns(text.substr(0, end), name, attributes));
  const bool is_plain = end < text.size() && plain.Add(text.substr(end + 1)) && plain.size() > 0;
  return is_plain ? plain.Take() : PointReader(text, name, attributes).Read();
}

}  // namespace semblance::problems
