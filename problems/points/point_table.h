// SPDX-License-Identifier: GPL-3.0-or-later
// Scattered points in a CSV file.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

struct PointTable {
  std::vector<Vec3> positions;  // mm
  std::vector<Vec2> uv;         // one per point, or none
  std::vector<double> weights;  // > 0; one per point, or none
};

enum class PointColumn { kX, kY, kZ, kU, kV, kWeight };
constexpr std::size_t kPointColumns = 6;
// What the columns of a table are, by its first line. Throws as ParsePointTable.
std::vector<PointColumn> PointColumnsOf(std::string_view first_line, std::string_view name);

// The first line names the columns, in any order: x, y and z, and, if wanted, u and v together and
// weight. Each further line has one decimal number per column, separated by commas. Nothing else is
// let pass: `name:line: what` as IoError for another column or one twice, a line with more or fewer
// entries, an empty line before the end, what is not a finite number, a weight that is not
// positive, or no point at all.
PointTable ParsePointTable(std::string_view text, std::string_view name);

}  // namespace semblance
