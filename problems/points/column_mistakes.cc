// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/column_mistakes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

constexpr std::string_view kDigits = "0123456789";
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Calls use(column, entry) for each entry of the rows. Entries have no blanks, signs or quotes.
template <class Use>
void ForEachEntry(std::string_view rows, std::string_view separators, const Use& use) {
  std::size_t column = 0;
  for (std::size_t begin = 0; begin < rows.size();) {
    const std::size_t end =
        std::min(rows.find_first_of(std::string(separators) + "\n", begin), rows.size());
    std::string_view entry = rows.substr(begin, end - begin);
    entry.remove_prefix(std::min(entry.find_first_not_of(" \t\r\"+-"), entry.size()));
    entry = entry.substr(0, entry.find_last_not_of(" \t\r\"") + 1);
    use(column, entry);
    column = end < rows.size() && rows[end] != '\n' ? column + 1 : 0;
    begin = end + 1;
  }
}

enum class Grouping { kGrouped, kSmall, kOther };

// Grouped: 12,345 or 12.345; small: a whole number below 1000; other: what thousands would not be.
Grouping FindGrouping(std::string_view entry) {
  const std::size_t whole = std::min(entry.find_first_not_of(kDigits), entry.size());
  if (whole == 0 || whole > 3) {
    return Grouping::kOther;
  }
  if (whole == entry.size()) {
    return Grouping::kSmall;
  }
  const bool is_group = entry[0] != '0' && entry.size() == whole + 4 &&
                        (entry[whole] == ',' || entry[whole] == '.') &&
                        entry.find_first_not_of(kDigits, whole + 1) == entry.npos;
  return is_group ? Grouping::kGrouped : Grouping::kOther;
}

struct ColumnGroups {
  std::size_t grouped = 0, small = 0, other = 0;
  std::string example;

  void Add(std::string_view entry) {
    const Grouping grouping = FindGrouping(entry);
    grouped += grouping == Grouping::kGrouped;
    small += grouping == Grouping::kSmall;
    other += grouping == Grouping::kOther;
    if (grouping == Grouping::kGrouped && example.empty()) {
      example = entry;
    }
  }
};

struct Range {
  double least = kInfinity, most = -kInfinity;

  void Add(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
};

Range FindRange(const PointTable& table, int axis) {
  Range range;
  for (const Vec3& p : table.positions) {
    if (p.allFinite()) {
      range.Add(p[axis]);
    }
  }
  return range;
}

void RefuseLatitudes(const PointTable& table) {
  constexpr double kMost = 90, kRound = 360;  // values beyond a full circle are no degrees
  const Range y = FindRange(table, 1);
  const double farthest = std::max(-y.least, y.most);
  if (farthest > kMost && farthest <= kRound) {
    throw IoError(fmt::format(
        "{}: latitudes go from {} to {}, and end at 90 degrees; the columns of latitude "
        "and longitude may be exchanged",
        table.file, y.least, y.most));
  }
}

// The longitudes around the empty half circle: those west of `middle`, and those east of it.
void RefuseSplitLongitudes(const PointTable& table, const Range& x) {
  // Degrees. The empty part must be wider than half a circle, and ten times as wide as the part
  // across the meridian.
  constexpr double kHalf = 180, kRound = 360, kShare = 0.1;
  const double across = kRound - (x.most - x.least), middle = 0.5 * (x.least + x.most);
  Range west, east;
  for (const Vec3& p : table.positions) {
    if (p.allFinite()) {
      (p.x() < middle ? west : east).Add(p.x());
    }
  }
  const double gap = east.least - west.most;
  if (gap > kHalf && across >= 0 && across < kShare * gap) {
    throw IoError(fmt::format(
        "{}: longitudes lie at {} to {} and at {} to {} degrees: points that are neighbours lie a "
        "circle apart; {}",
        table.file, west.least, west.most, east.least, east.most,
        x.least < 0 ? "add 360 to the negative longitudes"
                    : "subtract 360 from the longitudes above 180"));
  }
}

}  // namespace

void RefuseRowNumbers(const PointTable& table, std::size_t further, std::string_view name) {
  constexpr std::size_t kFewest = 16;  // points; a row of fewer may be a profile along x
  const std::vector<Vec3>& p = table.positions;
  if (further == 0 || p.size() < kFewest) {
    return;
  }
  const double step = p[1].x() - p[0].x();
  for (std::size_t k = 0; k < p.size(); ++k) {
    const double x = p[k].x();
    if (step == 0 || x != std::floor(x) || (k > 0 && x - p[k - 1].x() != step)) {
      return;
    }
  }
  throw IoError(
      fmt::format("{}: the first column counts from {} to {} in steps of {}, as numbers of rows "
                  "do, and columns without names are taken for x, y and z; name the columns in the "
                  "first line, or leave the first one out",
                  name, p.front().x(), p.back().x(), step));
}

void RefuseThousands(std::string_view rows, std::string_view separators, std::string_view name) {
  std::vector<ColumnGroups> columns;
  ForEachEntry(rows, separators, [&](std::size_t column, std::string_view entry) {
    columns.resize(std::max(columns.size(), column + 1));
    if (!entry.empty()) {
      columns[column].Add(entry);
    }
  });
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (const ColumnGroups& c = columns[k]; c.grouped > 0 && c.small > 0 && c.other == 0) {
      throw IoError(fmt::format(
          "{}: column {} has {} beside whole numbers below 1000, as with separators of thousands, "
          "which would be read as decimals; export it without them",
          name, k + 1, c.example));
    }
  }
}

void RefuseCommasWithin(std::string_view rows, std::string_view name) {
  constexpr std::size_t kEntries = 6;
  bool has_zero = false, is_whole = true;
  std::size_t last = 0;
  for (std::size_t begin = 0, column = 0; is_whole && begin < rows.size(); ++column) {
    const std::size_t end = std::min(rows.find_first_of(",\n", begin), rows.size());
    std::string_view entry = rows.substr(begin, end - begin);
    entry = entry.substr(0, entry.find_last_not_of(" \t\r") + 1);
    const bool is_decimals = column % 2 == 1;
    entry.remove_prefix(!is_decimals && entry.starts_with('-') ? 1 : 0);
    is_whole = !entry.empty() && entry.find_first_not_of(kDigits) == entry.npos;
    has_zero = has_zero || (is_decimals && entry.size() > 1 && entry[0] == '0');
    const bool ends = end >= rows.size() || rows[end] == '\n';
    is_whole = is_whole && (!ends || column + 1 == kEntries);
    column = ends ? static_cast<std::size_t>(-1) : column;
    begin = end + 1;
    last = end;
  }
  if (has_zero && is_whole && last > 0) {
    throw IoError(
        fmt::format("{}: each row has six whole numbers, and some that follow a comma begin with "
                    "0: they look like three numbers with decimal commas; write decimal points, or "
                    "semicolons between the columns",
                    name));
  }
}

bool HasDecimalCommas(std::string_view row) {
  std::size_t entries = 0;
  bool all_have = true;
  for (std::size_t begin = row.find_first_not_of(" \t\r"); begin < row.size();) {
    const std::size_t end = std::min(row.find_first_of(" \t\r", begin), row.size());
    const std::string_view entry = row.substr(begin, end - begin);
    const std::size_t comma = entry.find(',');
    all_have = all_have && comma != entry.npos && comma > 0 && comma + 1 < entry.size() &&
               entry.find(',', comma + 1) == entry.npos && entry.find('.') == entry.npos;
    ++entries;
    begin = row.find_first_not_of(" \t\r", end);
  }
  return all_have && entries >= 3;
}

void RefuseWrongDegrees(const PointTable& table) {
  constexpr double kRound = 360;  // map coordinates in metres also bear these names
  const Range x = table.has_degrees ? FindRange(table, 0) : Range();
  if (x.least >= -kRound && x.most <= kRound && x.least <= x.most) {
    RefuseLatitudes(table);
    RefuseSplitLongitudes(table, x);
  }
}

}  // namespace semblance::problems
