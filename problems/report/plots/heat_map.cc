// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/plots/heat_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/report/pictures/colour_map.h"
#include "problems/report/plots/svg_parts.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Sizes in pixels: labels on the left, height of a row, names of the columns, whole map, widest
// cell.
constexpr double kMapLabels = 250, kRow = 26, kHead = 110, kLargestWidth = 900, kWidestCell = 84;
constexpr double kNumberWidth = 40;  // a narrower cell shows no number
constexpr double kMargin = 10;

struct Limits {
  double low = std::numeric_limits<double>::infinity(), high = -low;
};

Limits FindLimits(const HeatMap& map) {
  Limits limits;
  for (const auto& row : map.values) {
    if (row.size() != map.columns.size()) {
      throw InputError(
          fmt::format("map '{}': a row has {} values for {} columns; give one per column",
                      map.title, row.size(), map.columns.size()));
    }
    for (const double value : row) {
      if (std::isfinite(value)) {
        limits = {std::min(limits.low, value), std::max(limits.high, value)};
      }
    }
  }
  return limits;
}

// The name of a column, slanted so that long names have room.
std::string ColumnName(double x, const std::string& name) {
  std::string text = svg::Text(0, 0, svg::Shortened(name), "start");
  return fmt::format("<g transform=\"translate({:.2f} {:.2f}) rotate(-40)\">{}{}</g>\n", x,
                     kHead - 8, text, svg::Title(name));
}

// Writes every number with the decimals that give the largest one three significant figures.
std::string NumberText(double value, const Limits& limits) {
  const double largest = std::max(std::abs(limits.low), std::abs(limits.high));
  if (!(largest >= 1e-3 && largest < 1e5)) {
    return fmt::format("{:.3g}", value);
  }
  const int digits = std::max(0, 2 - static_cast<int>(std::floor(std::log10(largest))));
  return fmt::format("{:.{}f}", value, digits);
}

std::string Cell(const HeatMap& map, std::size_t r, std::size_t c, const Limits& limits,
                 double width) {
  const double value = map.values[r][c], x = kMapLabels + width * static_cast<double>(c),
               y = kHead + kRow * static_cast<double>(r);
  const std::string place = fmt::format("{} | {}: ", map.rows[r], map.columns[c]);
  if (!std::isfinite(value)) {
    return svg::Text(x + width / 2, y + kRow / 2 + 5, "–", "middle");
  }
  const double share =
      limits.high > limits.low ? (value - limits.low) / (limits.high - limits.low) : 0.5;
  const ColourMap colours = SequentialMap(0, 1);
  std::string text = fmt::format(
      "<rect class=\"cell\" x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
      "fill=\"{}\">{}</rect>\n",
      x, y, width - 1, kRow - 1, HexText(ColourAt(colours, share)),
      svg::Title(fmt::format("{}{:.6g}", place, value)));
  if (width >= kNumberWidth) {
    text += fmt::format(
        "<text class=\"in-cell\" x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"middle\" font-size=\"12\" "
        "fill=\"{}\" pointer-events=\"none\">{}</text>\n",
        x + width / 2, y + kRow / 2 + 4, share > 0.6 ? "#000" : "#fff", NumberText(value, limits));
  }
  const bool has_link = r < map.links.size() && c < map.links[r].size() && !map.links[r][c].empty();
  return has_link ? fmt::format("<a href=\"{}\">{}</a>\n", EscapeHtml(map.links[r][c]), text)
                  : text;
}

}  // namespace

std::string HeatMapSvg(const HeatMap& map) {
  const Limits limits = FindLimits(map);
  const auto columns = static_cast<double>(std::max<std::size_t>(1, map.columns.size()));
  const double width = std::min(kWidestCell, (kLargestWidth - kMapLabels - 60) / columns);
  const double bottom = kHead + kRow * static_cast<double>(map.rows.size());
  const std::string ends = limits.low <= limits.high ? fmt::format(": {:.4g} dark to {:.4g} yellow",
                                                                   limits.low, limits.high)
                                                     : "";
  const double all = kMapLabels + width * columns + 60,
               title = kMargin + svg::TextWidth(map.title + ends) + kMargin;
  std::string text = svg::Open(bottom + 34, std::max(all, title));
  for (std::size_t c = 0; c < map.columns.size(); ++c) {
    text += ColumnName(kMapLabels + width * (static_cast<double>(c) + 0.4), map.columns[c]);
  }
  for (std::size_t r = 0; r < map.rows.size(); ++r) {
    text += svg::Text(kMapLabels - 10, kHead + kRow * (static_cast<double>(r) + 0.5) + 5,
                      svg::Shortened(map.rows[r]), "end");
    for (std::size_t c = 0; c < map.columns.size(); ++c) {
      text += Cell(map, r, c, limits, width);
    }
  }
  return text + svg::Text(kMargin, bottom + 24, map.title + ends, "start") + "</svg>\n";
}

}  // namespace semblance::problems
