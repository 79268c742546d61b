// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/plots/axis_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "problems/plots/svg_parts.h"
#include "problems/plots/svg_plot.h"

namespace semblance {
namespace {

constexpr double kWidth = 720, kLeft = 80, kRight = 30, kTop = 40, kBottom = 340;
constexpr std::size_t kMostLines = 12;

// From numbers to places along one side of the plot.
class Scale {
 public:
  Scale(double low, double high, bool logarithmic, double from, double to)
      : low_(Of(low, logarithmic)),
        high_(Of(high, logarithmic)),
        logarithmic_(logarithmic),
        from_(from),
        to_(to) {
    if (!(high_ > low_)) {
      low_ -= 1;
      high_ += 1;
    }
  }
  double At(double value) const {
    return from_ + (Of(value, logarithmic_) - low_) / (high_ - low_) * (to_ - from_);
  }

 private:
  static double Of(double value, bool logarithmic) { return logarithmic ? std::log(value) : value; }
  double low_, high_;
  bool logarithmic_;
  double from_, to_;
};

struct Limits {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void Take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

std::string Polyline(const AxisLine& line, const Scale& x, const Scale& y, std::size_t n) {
  std::string points;
  for (const AxisPoint& p : line.points) {
    points += fmt::format("{:.2f},{:.2f} ", x.At(p.x), y.At(p.y));
  }
  return fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}/>\n",
                     points, svg::kColours[n % svg::kColours.size()],
                     n >= svg::kColours.size() ? " stroke-dasharray=\"6 4\"" : "");
}

// Every x that occurs, as long as they do not stand too close.
std::string XTicks(const std::vector<AxisLine>& lines, const Scale& x) {
  std::set<double> values;
  for (const AxisLine& line : lines) {
    for (const AxisPoint& p : line.points) {
      values.insert(p.x);
    }
  }
  std::string text;
  double last = -std::numeric_limits<double>::infinity();
  for (const double value : values) {
    if (x.At(value) - last > 44) {
      last = x.At(value);
      text += svg::Line(last, kTop, last, kBottom, "#dfe3e8", 1);
      text += svg::Text(last, kBottom + 20, fmt::format("{:.4g}", value), "middle");
    }
  }
  return text;
}

std::string YTicks(double low, double high, double step, const Scale& y) {
  std::string text;
  for (int n = 0; low + n * step <= high + 1e-9 * step; ++n) {
    const double value = low + n * step, at = y.At(value);
    text += svg::Line(kLeft, at, kWidth - kRight, at, "#dfe3e8", 1);
    text += svg::Text(kLeft - 8, at + 5, fmt::format("{:.6g}", value), "end");
  }
  return text;
}

// Of all points.
struct Ranges {
  Limits across, up;
};

// Sorts each line's points by x.
Ranges RangesOf(std::vector<AxisLine>& lines) {
  Ranges ranges;
  for (AxisLine& line : lines) {
    std::ranges::stable_sort(line.points, {}, &AxisPoint::x);
    for (const AxisPoint& p : line.points) {
      ranges.across.Take(p.x);
      ranges.up.Take(p.y);
    }
  }
  if (!(ranges.across.low <= ranges.across.high)) {
    ranges = {{0, 1}, {0, 1}};
  }
  return ranges;
}

// The n-th line with its points, and its row of the legend.
std::string LineSvg(const AxisLine& line, const Scale& x, const Scale& y, std::size_t n) {
  const char* const colour = svg::kColours[n % svg::kColours.size()];
  std::string text = line.is_joined ? Polyline(line, x, y, n) : "";
  for (const AxisPoint& p : line.points) {
    text += svg::Dot(x.At(p.x), y.At(p.y), 5, p.name, colour);
  }
  const double at = kBottom + 68 + 22 * static_cast<double>(n);
  text += line.is_joined ? svg::Line(kLeft, at, kLeft + 26, at, colour, 3)
                         : svg::Dot(kLeft + 13, at, 5, "", colour);
  return text + svg::Text(kLeft + 34, at + 5, svg::Shortened(line.label), "start");
}

}  // namespace

std::string AxisPlotSvg(std::vector<AxisLine> lines, const std::string& x_label,
                        const std::string& y_label) {
  const std::size_t left_out = lines.size() - std::min(lines.size(), kMostLines);
  lines.resize(lines.size() - left_out);
  const auto [across, up] = RangesOf(lines);
  double low = up.low >= 0 && up.low < 0.5 * up.high ? 0 : up.low;
  double high = up.high > low ? up.high : low + 1;
  const double step = TickStep(low, high, 6);
  low = step * std::floor(low / step);
  high = step * std::ceil(high / step);
  const bool logarithmic = across.low > 0 && across.high > 20 * across.low;
  const Scale x(across.low, across.high, logarithmic, kLeft + 20, kWidth - kRight - 20),
      y(low, high, /*logarithmic=*/false, kBottom, kTop);
  const double legend = 22 * static_cast<double>(lines.size() + (left_out > 0 ? 1 : 0));
  std::string text = svg::Open(kBottom + 64 + legend, kWidth) + XTicks(lines, x) +
                     YTicks(low, high, step, y) + svg::Text(8, 20, y_label, "start") +
                     svg::Text((kLeft + kWidth - kRight) / 2, kBottom + 44,
                               x_label + (logarithmic ? " (logarithmic)" : ""), "middle");
  for (std::size_t n = 0; n < lines.size(); ++n) {
    text += LineSvg(lines[n], x, y, n);
  }
  if (left_out > 0) {
    text += svg::Text(kLeft, kBottom + 73 + 22 * static_cast<double>(lines.size()),
                      fmt::format("and {} more, not drawn", left_out), "start");
  }
  return text + "</svg>\n";
}

}  // namespace semblance
