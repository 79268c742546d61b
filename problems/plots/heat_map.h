// SPDX-License-Identifier: GPL-3.0-or-later
// A table of numbers as coloured cells, as an SVG file.
#pragma once

#include <string>
#include <vector>

namespace semblance {

struct HeatMap {
  std::vector<std::string> rows, columns;
  std::vector<std::vector<double>> values;           // [row][column]; NaN where there is none
  std::string title;                                 // what the numbers are
  std::vector<std::vector<std::string>> links = {};  // [row][column]: where a cell leads; or none
};

// The smallest number is dark, the largest yellow; a cell says its number where there is room, and
// wherever the pointer rests. A cell without a number is empty, with a dash. Throws InputError for
// a row that has another number of values than there are columns.
std::string HeatMapSvg(const HeatMap& map);

}  // namespace semblance
