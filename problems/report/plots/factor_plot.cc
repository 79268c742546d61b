// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/plots/factor_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/report/plots/svg_parts.h"
#include "problems/report/plots/svg_plot.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Sizes in pixels. The plots are narrow, so that their text stays readable on a phone.
constexpr double kPlotWidth = 640, kPlotLeft = 64, kPlotRight = 16, kPlotTop = 44, kPanelTall = 250,
                 kPanelFoot = 60;
constexpr double kLegendRow = 22, kDodge = 5;
constexpr std::size_t kMostLines = 12, kMostPanels = 6;

// Round limits of all means and their intervals. They start at 0 if the values come near it.
struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low, step = 1;

  void Include(double value) {
    if (std::isfinite(value)) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  void Include(const PlottedMean& mean) {
    Include(mean.mean);
    Include(mean.interval.low);
    Include(mean.interval.high);
  }
  void Round(int ticks) {
    if (!(low <= high)) {
      low = 0;
      high = 1;
    }
    low = low >= 0 && low < 0.5 * high ? 0 : low;
    high = high > low ? high : low + 1;
    step = TickStep(low, high, ticks);
    low = step * std::floor(low / step);
    high = step * std::ceil(high / step);
  }
  // The ticks from the lowest to the highest.
  std::vector<double> Ticks() const {
    std::vector<double> ticks;
    for (int n = 0; low + n * step <= high + 1e-9 * step; ++n) {
      ticks.push_back(low + n * step);
    }
    return ticks;
  }
  double Share(double value) const { return (value - low) / (high - low); }
};

void CheckPlot(const FactorPlot& plot) {
  bool fits = plot.positions.size() == plot.levels.size() && !plot.levels.empty();
  for (const FactorPanel& panel : plot.panels) {
    fits &= panel.lines.size() == plot.lines.size();
    for (const auto& line : panel.lines) {
      fits &= line.size() == plot.levels.size();
    }
  }
  if (!fits) {
    throw InputError(fmt::format(
        "plot of {}: {} levels, {} positions and {} lines; give each level a position, and each "
        "panel one mean per line and level",
        plot.x_label, plot.levels.size(), plot.positions.size(), plot.lines.size()));
  }
}

// The place of one panel, and the scales in it.
struct PanelFrame {
  double left = 0, top = 0, width = 0;
  Range up;
  std::vector<double> x;  // of each level

  double Bottom() const { return top + kPanelTall; }
  double Y(double value) const { return Bottom() - up.Share(value) * kPanelTall; }
};

bool IsLogarithmic(const FactorPlot& plot) {
  const auto [low, high] = std::ranges::minmax(plot.positions);
  return low > 0 && high > 20 * low;
}

// The pixels of each level within a panel of this width.
std::vector<double> PlaceLevels(const FactorPlot& plot, double width) {
  constexpr double kMargin = 36;
  const auto [low, high] = std::ranges::minmax(plot.positions);
  const auto scaled = [is_log = IsLogarithmic(plot)](double x) { return is_log ? std::log(x) : x; };
  std::vector<double> x;
  for (const double position : plot.positions) {
    const double share =
        high > low ? (scaled(position) - scaled(low)) / (scaled(high) - scaled(low)) : 0.5;
    x.push_back(kMargin + share * (width - 2 * kMargin));
  }
  return x;
}

// Names of levels below the axis, each with a line. A name that would touch the previous one is
// left out; every mean shows its level when the pointer rests on it.
std::string LevelNames(const FactorPlot& plot, const PanelFrame& frame) {
  std::string text;
  const double room = frame.width / static_cast<double>(plot.levels.size());
  double end = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < plot.levels.size(); ++k) {
    const auto most = std::max<std::size_t>(6, static_cast<std::size_t>(room / 7.5));
    std::string name = svg::Shortened(plot.levels[k]);
    name = name.size() > most ? svg::CutTo(name, most - 1) : name;
    const double x = frame.left + frame.x[k], half = 3.5 * static_cast<double>(name.size());
    if (x - half > end) {
      text += svg::Line(x, frame.top, x, frame.Bottom(), "#dfe3e8", 1);
      text += svg::Text(x, frame.Bottom() + 19, name, "middle");
      end = x + half + 4;
    }
  }
  return text;
}

std::string PanelGrid(const FactorPlot& plot, const FactorPanel& panel, const PanelFrame& frame,
                      bool has_numbers) {
  std::string text = LevelNames(plot, frame);
  for (const double tick : frame.up.Ticks()) {
    const double y = frame.Y(tick);
    text += svg::Line(frame.left, y, frame.left + frame.width, y, "#dfe3e8", 1);
    text += has_numbers ? svg::Text(frame.left - 8, y + 5, fmt::format("{:.6g}", tick), "end") : "";
  }
  return text + (panel.heading.empty() ? ""
                                       : svg::Text(frame.left + frame.width / 2, frame.top - 8,
                                                   svg::Shortened(panel.heading), "middle"));
}

std::string MeanTitle(const std::string& label, const PlottedMean& mean) {
  const std::string interval =
      std::isfinite(mean.interval.low)
          ? fmt::format(" ({:.4g} to {:.4g})", mean.interval.low, mean.interval.high)
          : "";
  return fmt::format("{}: {:.4g}{}", label, mean.mean, interval);
}

// The line is dashed once the colours repeat. Lines are shifted sideways, so that whiskers do not
// cover each other.
std::string PanelLine(const FactorPlot& plot, const FactorPanel& panel, const PanelFrame& frame,
                      std::size_t n) {
  const char* const colour = svg::kColours[n % svg::kColours.size()];
  const auto count = static_cast<double>(std::min(plot.lines.size(), kMostLines));
  const double shift = kDodge * (static_cast<double>(n) - (count - 1) / 2);
  std::string points, marks;
  for (std::size_t k = 0; k < plot.levels.size(); ++k) {
    const PlottedMean& mean = panel.lines[n][k];
    const double x = frame.left + frame.x[k] + shift, y = frame.Y(mean.mean);
    points += fmt::format("{:.2f},{:.2f} ", x, y);
    if (std::isfinite(mean.interval.low)) {
      marks += svg::Line(x, frame.Y(mean.interval.low), x, frame.Y(mean.interval.high), colour, 2);
    }
    const std::string name =
        plot.lines[n].empty() ? plot.levels[k] : plot.lines[n] + ", " + plot.levels[k];
    marks += svg::Dot(x, y, 4.5, MeanTitle(name, mean), colour);
  }
  return fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}/>\n",
                     points, colour, n >= svg::kColours.size() ? " stroke-dasharray=\"6 4\"" : "") +
         marks;
}

std::string PlotLegend(const FactorPlot& plot, std::size_t lines, std::size_t panels, double top) {
  std::string text;
  double y = top;
  for (std::size_t n = 0; n < lines && !plot.lines[n].empty(); ++n, y += kLegendRow) {
    text += svg::Line(kPlotLeft, y, kPlotLeft + 26, y, svg::kColours[n % svg::kColours.size()], 3) +
            svg::Text(kPlotLeft + 34, y + 5, svg::Shortened(plot.lines[n]), "start");
  }
  if (lines < plot.lines.size() || panels < plot.panels.size()) {
    text += svg::Text(kPlotLeft, y + 5,
                      fmt::format("{} more lines and {} more panels are not drawn",
                                  plot.lines.size() - lines, plot.panels.size() - panels),
                      "start");
  }
  return text;
}

// One line has no name and needs no legend. Left-out lines and panels share one row.
std::size_t CountLegendRows(const FactorPlot& plot, std::size_t lines, std::size_t panels) {
  const bool is_cut = lines < plot.lines.size() || panels < plot.panels.size();
  return (plot.lines[0].empty() ? 0 : lines) + (is_cut ? 1 : 0);
}

}  // namespace

std::string FactorPlotSvg(const FactorPlot& plot) {
  CheckPlot(plot);
  const std::size_t lines = std::min(plot.lines.size(), kMostLines),
                    panels = std::min(plot.panels.size(), kMostPanels);
  PanelFrame frame;
  for (std::size_t p = 0; p < panels; ++p) {
    for (std::size_t n = 0; n < lines; ++n) {
      for (const PlottedMean& mean : plot.panels[p].lines[n]) {
        frame.up.Include(mean);
      }
    }
  }
  frame.up.Round(/*ticks=*/6);
  const std::size_t columns = panels > 1 ? 2 : 1, rows = (panels + columns - 1) / columns;
  const double cell = (kPlotWidth - kPlotLeft - kPlotRight) / static_cast<double>(columns);
  frame.width = cell - (columns > 1 ? 12 : 0);
  frame.x = PlaceLevels(plot, frame.width);
  const double bottom = kPlotTop + static_cast<double>(rows) * (kPanelTall + kPanelFoot),
               legend = kLegendRow * static_cast<double>(CountLegendRows(plot, lines, panels));
  std::string text =
      svg::Open(bottom + 6 + legend, kPlotWidth) + svg::Text(8, 18, plot.y_label, "start");
  for (std::size_t p = 0; p < panels; ++p) {
    frame.left = kPlotLeft + cell * static_cast<double>(p % columns);
    frame.top = kPlotTop + static_cast<double>(p / columns) * (kPanelTall + kPanelFoot);
    text += PanelGrid(plot, plot.panels[p], frame, /*has_numbers=*/p % columns == 0);
    for (std::size_t n = 0; n < lines; ++n) {
      text += PanelLine(plot, plot.panels[p], frame, n);
    }
  }
  return text +
         svg::Text((kPlotLeft + kPlotWidth - kPlotRight) / 2, bottom - 14,
                   plot.x_label + (IsLogarithmic(plot) ? " (logarithmic)" : ""), "middle") +
         PlotLegend(plot, lines, panels, bottom + 12) + "</svg>\n";
}

std::string MeansPlotSvg(const std::vector<PlottedLevel>& rows, const std::string& axis_label) {
  constexpr double kLabels = 220, kRow = 26, kHeading = 30;
  Range range;
  double bottom = 10;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    range.Include(rows[n].mean);
    bottom += kRow + (n == 0 || rows[n].group != rows[n - 1].group ? kHeading : 0);
  }
  range.Round(/*ticks=*/5);
  const auto x = [&](double value) {
    return kLabels + range.Share(value) * (kPlotWidth - kPlotRight - kLabels);
  };
  std::string text = svg::Open(bottom + 54, kPlotWidth);
  for (const double tick : range.Ticks()) {
    text += svg::Line(x(tick), 10, x(tick), bottom, "#dfe3e8", 1) +
            svg::Text(x(tick), bottom + 19, fmt::format("{:.6g}", tick), "middle");
  }
  text += svg::Text(std::max(8.0, kPlotWidth - 8 - svg::TextWidth(axis_label)), bottom + 42,
                    axis_label, "start");
  double y = 10;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    if (n == 0 || rows[n].group != rows[n - 1].group) {
      text += svg::Text(8, y + 20, rows[n].group, "start");
      y += kHeading;
    }
    const PlottedMean& mean = rows[n].mean;
    const double middle = y + kRow / 2;
    text += svg::Text(kLabels - 12, middle + 5, svg::Shortened(rows[n].label), "end");
    if (std::isfinite(mean.interval.low)) {
      text += svg::Line(x(mean.interval.low), middle, x(mean.interval.high), middle, "#0b5c8f", 3);
    }
    text += svg::Dot(x(mean.mean), middle, 5, MeanTitle(rows[n].label, mean));
    y += kRow;
  }
  return text + "</svg>\n";
}

}  // namespace semblance::problems
