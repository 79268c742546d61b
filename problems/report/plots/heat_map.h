// SPDX-License-Identifier: GPL-3.0-or-later
// A table of numbers as coloured cells, as an SVG file.
#pragma once

#include <string>
#include <vector>

namespace semblance::problems {

struct HeatMap {
  std::vector<std::string> rows, columns;
  std::vector<std::vector<double>> values;           // [row][column]; NaN for no value
  std::string title;                                 // the quantity of the numbers
  std::vector<std::vector<std::string>> links = {};  // [row][column]: target of the cell's link
};

// The smallest number is dark, the largest yellow. A cell shows its number if there is room, and
// always when the pointer rests on it. A cell without a number is empty, with a dash. Throws
// InputError if a row does not have one value per column.
std::string HeatMapSvg(const HeatMap& map);

}  // namespace semblance::problems
