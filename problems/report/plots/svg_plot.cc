// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/plots/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "problems/experiment/metrics/statistics.h"
#include "problems/report/plots/svg_parts.h"
#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

using svg::kColours;
using svg::Line;
using svg::Open;
using svg::Shortened;
using svg::Text;

constexpr double kWidth = 900, kLabels = 330, kRight = 30;

// The axis of numbers below a plot.
class Axis {
 public:
  Axis(const std::vector<BoxRow>& rows, double left) : left_(left) {
    bool any = false;
    for (const BoxRow& row : rows) {
      for (const double value : row.values) {
        low_ = any ? std::min(low_, value) : value;
        high_ = any ? std::max(high_, value) : value;
        any = true;
      }
    }
    if (low_ >= 0 && low_ < 0.5 * high_) {
      low_ = 0;  // lengths are easier to compare from 0
    }
    high_ = high_ > low_ ? high_ : low_ + 1;
    step_ = TickStep(low_, high_, 7);
    low_ = step_ * std::floor(low_ / step_);
    high_ = step_ * std::ceil(high_ / step_);
  }
  double At(double value) const {
    return left_ + (value - low_) / (high_ - low_) * (kWidth - kRight - left_);
  }
  std::string Draw(double top, double bottom, const std::string& label) const {
    std::string svg;
    for (int n = 0; low_ + n * step_ <= high_ + 1e-9 * step_; ++n) {
      const double value = low_ + n * step_;
      svg += Line(At(value), top, At(value), bottom, "#dfe3e8", 1);
      svg += Text(At(value), bottom + 20, fmt::format("{:.6g}", value), "middle");
    }
    return svg + Text(LabelMiddle(label), bottom + 44, label, "middle");
  }

 private:
  // The middle of the axis, moved if the label would leave the picture.
  double LabelMiddle(const std::string& label) const {
    const double middle = (left_ + kWidth - kRight) / 2;
    return std::max(kWidth / 2, std::min(middle, kWidth - svg::TextWidth(label) / 2));
  }

  double left_, low_ = 0, high_ = 1, step_ = 1;
};

std::string Box(const BoxRow& row, const Axis& axis, double y) {
  const SampleSummary s = Summarize(row.values);
  const double reach = 1.5 * (s.quartile_3 - s.quartile_1);
  double low = s.quartile_1, high = s.quartile_3;
  for (const double value : row.values) {
    low = value >= s.quartile_1 - reach ? std::min(low, value) : low;
    high = value <= s.quartile_3 + reach ? std::max(high, value) : high;
  }
  std::string svg = Line(axis.At(low), y, axis.At(high), y, "#5c6570", 1.5);
  svg += fmt::format(
      "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"18\" fill=\"#cfe3f1\" "
      "stroke=\"#0b5c8f\"/>\n",
      axis.At(s.quartile_1), y - 9, axis.At(s.quartile_3) - axis.At(s.quartile_1));
  svg += Line(axis.At(s.median), y - 9, axis.At(s.median), y + 9, "#0b5c8f", 3);
  for (std::size_t k = 0; k < row.values.size(); ++k) {
    const std::string name = k < row.names.size() ? row.names[k] + ": " : "";
    svg += problems::svg::Dot(axis.At(row.values[k]), y, 4,
                              fmt::format("{}{:.6g}", name, row.values[k]));
  }
  return svg;
}

// The n-th line of a plot. Lines are dashed once the colours repeat.
std::string Polyline(const std::string& points, std::size_t n, const std::string& title = "") {
  return fmt::format(
      "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}>{}</polyline>\n",
      points, kColours[n % kColours.size()],
      n >= kColours.size() ? " stroke-dasharray=\"6 4\"" : "", svg::Title(title));
}

double LegendHeight(const std::vector<BoxRow>& rows) {
  return 22 * static_cast<double>((rows.size() + 1) / 2);
}

// Two columns of labels below a plot of lines.
std::string LineLegend(const std::vector<BoxRow>& rows, double left, double top) {
  std::string svg;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const double x = left + static_cast<double>(n % 2) * (kWidth - left) / 2,
                 y = top + 22 * static_cast<double>(n / 2);
    svg += Polyline(fmt::format("{:.2f},{:.2f} {:.2f},{:.2f}", x, y, x + 26, y), n) +
           Text(x + 34, y + 5, Shortened(rows[n].label), "start");
  }
  return svg;
}

constexpr double kShareTop = 20, kShareBottom = 340, kShareLeft = 60;

double ShareAt(double share) { return kShareBottom - share * (kShareBottom - kShareTop); }

// A plot of shares over an axis of numbers, still without lines.
std::string OpenShares(const std::vector<BoxRow>& rows, const Axis& axis,
                       const std::string& axis_label) {
  std::string svg =
      Open(kShareBottom + 64 + LegendHeight(rows)) + axis.Draw(kShareTop, kShareBottom, axis_label);
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    svg += Line(kShareLeft, ShareAt(share), kWidth - kRight, ShareAt(share), "#dfe3e8", 1);
    svg += Text(kShareLeft - 8, ShareAt(share) + 5, fmt::format("{:.0f} %", 100 * share), "end");
  }
  return svg;
}

}  // namespace

double TickStep(double low, double high, int count) {
  const double rough = (high - low) / count;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= rough) {
      return step * power;
    }
  }
  return 10 * power;
}

std::string BoxPlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label) {
  constexpr double kRow = 30, kTop = 14;
  const Axis axis(rows, kLabels);
  const double bottom = kTop + kRow * static_cast<double>(rows.size());
  std::string svg = Open(bottom + 56) + axis.Draw(kTop, bottom, axis_label);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const double y = kTop + kRow * (static_cast<double>(n) + 0.5);
    svg += Text(kLabels - 12, y + 5, Shortened(rows[n].label), "end");
    svg += rows[n].values.empty() ? Text(kLabels + 8, y + 5, "–", "start") : Box(rows[n], axis, y);
  }
  return svg + "</svg>\n";
}

std::string RankPlotSvg(std::vector<RankedLabel> treatments, double critical_difference) {
  std::stable_sort(treatments.begin(), treatments.end(),
                   [](const auto& a, const auto& b) { return a.mean_rank < b.mean_rank; });
  constexpr double kRow = 26, kTop = 70;
  const auto count = static_cast<double>(treatments.size());
  const auto at = [&](double rank) {
    return kLabels + (rank - 1) / std::max(count - 1, 1.0) * (kWidth - kRight - kLabels);
  };
  const double bottom = kTop + kRow * count;
  std::string svg = Open(bottom + 56);
  for (int rank = 1; rank <= static_cast<int>(count); ++rank) {
    svg += Line(at(rank), kTop - 8, at(rank), bottom, "#dfe3e8", 1);
    svg += Text(at(rank), bottom + 20, std::to_string(rank), "middle");
  }
  svg += Text((kLabels + kWidth - kRight) / 2, bottom + 44, "mean rank (1 is best)", "middle");
  if (std::isfinite(critical_difference)) {
    svg += Line(at(1), 34, at(1 + critical_difference), 34, "#d55e00", 4);
    svg += Text(at(1), 24, fmt::format("critical difference {:.2f}", critical_difference), "start");
  }
  for (std::size_t n = 0; n < treatments.size(); ++n) {
    const double y = kTop + kRow * (static_cast<double>(n) + 0.5);
    const double rank = treatments[n].mean_rank;
    svg += Text(kLabels - 12, y + 5, Shortened(treatments[n].label), "end");
    if (std::isfinite(critical_difference)) {  // joins the treatments that do not differ
      double last = rank;
      for (const RankedLabel& other : treatments) {
        last =
            other.mean_rank - rank <= critical_difference ? std::max(last, other.mean_rank) : last;
      }
      svg += Line(at(rank), y, at(last), y, "#9aa4af", 3);
    }
    svg += fmt::format(
        "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"6\" fill=\"#0b5c8f\">{}</circle>\n", at(rank), y,
        problems::svg::Title(fmt::format("{}: mean rank {:.3f}", treatments[n].label, rank)));
  }
  return svg + "</svg>\n";
}

std::string CumulativePlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label) {
  const Axis axis(rows, kShareLeft);
  std::string svg = OpenShares(rows, axis, axis_label);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    std::vector<double> values = rows[n].values;
    std::sort(values.begin(), values.end());
    std::string points;
    for (std::size_t k = 0; k < values.size(); ++k) {
      for (const double below : {static_cast<double>(k), static_cast<double>(k + 1)}) {
        points += fmt::format("{:.2f},{:.2f} ", axis.At(values[k]),
                              ShareAt(below / static_cast<double>(values.size())));
      }
    }
    svg += Polyline(points, n, rows[n].label);
  }
  return svg + LineLegend(rows, kShareLeft, kShareBottom + 68) + "</svg>\n";
}

std::string QuantilePlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label) {
  std::vector<BoxRow> shown = rows;
  for (BoxRow& row : shown) {
    if (!row.values.empty()) {
      row.values.pop_back();
    }
  }
  const Axis axis(shown, kShareLeft);
  std::string svg = OpenShares(rows, axis, axis_label);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    std::string points;
    for (std::size_t k = 0; k < shown[n].values.size(); ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(rows[n].values.size() - 1);
      points += fmt::format("{:.2f},{:.2f} ", axis.At(shown[n].values[k]), ShareAt(share));
    }
    svg += Polyline(points, n, rows[n].label);
  }
  return svg + LineLegend(rows, kShareLeft, kShareBottom + 68) + "</svg>\n";
}

std::string CalibrationPlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label) {
  const Axis axis({{"", {0, 100}}}, kShareLeft);
  std::string svg = OpenShares(rows, axis, axis_label);
  svg += Line(axis.At(0), ShareAt(0), axis.At(100), ShareAt(1), "#9aa4af", 2);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const auto count = static_cast<double>(rows[n].values.size());
    std::string points = fmt::format("{:.2f},{:.2f} ", axis.At(0), ShareAt(0));
    for (std::size_t k = 0; k < rows[n].values.size(); ++k) {
      const double stated = 100 * static_cast<double>(k + 1) / (count + 1);
      points += fmt::format("{:.2f},{:.2f} ", axis.At(stated), ShareAt(rows[n].values[k]));
    }
    points += fmt::format("{:.2f},{:.2f}", axis.At(100), ShareAt(1));
    svg += Polyline(points, n, rows[n].label);
  }
  return svg + LineLegend(rows, kShareLeft, kShareBottom + 68) + "</svg>\n";
}

std::string ConvergencePlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label) {
  constexpr double kTop = 34, kBottom = 340, kLeft = 60;
  double high = 0;
  std::size_t most = 2;
  for (const BoxRow& row : rows) {
    for (const double value : row.values) {
      high = std::max(high, value);
    }
    most = std::max(most, row.values.size());
  }
  const double step = TickStep(0, high > 0 ? high : 1, 6);
  high = step * std::max(1.0, std::ceil(high / step));
  const auto x = [&](std::size_t k) {
    return kLeft +
           static_cast<double>(k) / static_cast<double>(most - 1) * (kWidth - kRight - kLeft);
  };
  const auto y = [&](double value) { return kBottom - value / high * (kBottom - kTop); };
  std::string svg = Open(kBottom + 64 + LegendHeight(rows)) + Text(kLeft, 20, axis_label, "start");
  for (int n = 0; n * step <= high + 1e-9 * step; ++n) {
    svg += Line(kLeft, y(n * step), kWidth - kRight, y(n * step), "#dfe3e8", 1);
    svg += Text(kLeft - 8, y(n * step) + 5, fmt::format("{:.6g}", n * step), "end");
  }
  const std::size_t every = 1 + most / 24;
  for (std::size_t k = 0; k < most; k += every) {
    svg += Text(x(k), kBottom + 20, k == 0 ? "start" : std::to_string(k), "middle");
  }
  svg += Text((kLeft + kWidth - kRight) / 2, kBottom + 44, "step of the schedule", "middle");
  for (std::size_t n = 0; n < rows.size(); ++n) {
    std::string points;
    for (std::size_t k = 0; k < rows[n].values.size(); ++k) {
      points += fmt::format("{:.2f},{:.2f} ", x(k), y(rows[n].values[k]));
    }
    svg += Polyline(points, n, rows[n].label);
  }
  return svg + LineLegend(rows, kLeft, kBottom + 68) + "</svg>\n";
}

std::string HistogramsSvg(const std::vector<BoxRow>& rows) {
  constexpr std::size_t kAcross = 3;
  constexpr double kLeft = 16, kPanel = 290, kBars = 262, kTall = 110, kRow = 156, kHead = 24;
  double most = 0;
  for (const BoxRow& row : rows) {
    for (const double share : row.values) {
      most = std::max(most, share * static_cast<double>(row.values.size()));
    }
  }
  most = std::max(most, 1.5);
  std::string svg = Open(kRow * static_cast<double>((rows.size() + kAcross - 1) / kAcross) + 8);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const double left = kLeft + kPanel * static_cast<double>(n % kAcross),
                 foot = kRow * static_cast<double>(n / kAcross) + kHead + kTall,
                 wide = kBars / static_cast<double>(rows[n].values.size());
    svg += Text(left, foot - kTall - 8, Shortened(rows[n].label), "start");
    for (std::size_t k = 0; k < rows[n].values.size(); ++k) {
      const double tall =
          kTall * rows[n].values[k] * static_cast<double>(rows[n].values.size()) / most;
      svg += fmt::format(
          "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
          "fill=\"#cfe3f1\" stroke=\"#0b5c8f\"/>\n",
          left + wide * static_cast<double>(k), foot - tall, wide, tall);
    }
    svg += Line(left, foot - kTall / most, left + kBars, foot - kTall / most, "#9aa4af", 2) +
           Text(left, foot + 16, "0", "start") + Text(left + kBars, foot + 16, "1", "end");
  }
  return svg + "</svg>\n";
}

// ---------------------------------------------------------------------------------------------
// A number against a number
// ---------------------------------------------------------------------------------------------

namespace {

constexpr double kPanelWidth = 720, kPanelRight = 30, kPanelTop = 40;  // pixels
constexpr double kPanelLeft = 80, kAxisBottom = 340;
constexpr std::size_t kLargestLineCount = 12;  // more lines cannot be distinguished

// Maps numbers to positions along one side of the plot.
class Scale {
 public:
  Scale(double low, double high, bool logarithmic, double from, double to)
      : low_(Transform(low, logarithmic)),
        high_(Transform(high, logarithmic)),
        logarithmic_(logarithmic),
        from_(from),
        to_(to) {
    if (!(high_ > low_)) {
      low_ -= 1;
      high_ += 1;
    }
  }
  double At(double value) const {
    return from_ + (Transform(value, logarithmic_) - low_) / (high_ - low_) * (to_ - from_);
  }

 private:
  static double Transform(double value, bool logarithmic) {
    return logarithmic ? std::log(value) : value;
  }
  double low_, high_;
  bool logarithmic_;
  double from_, to_;
};

struct AxisLimits {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void Include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

std::string AxisPolyline(const AxisLine& line, const Scale& x, const Scale& y, std::size_t n) {
  std::string points;
  for (const AxisPoint& p : line.points) {
    points += fmt::format("{:.2f},{:.2f} ", x.At(p.x), y.At(p.y));
  }
  return fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}/>\n",
                     points, svg::kColours[n % svg::kColours.size()],
                     n >= svg::kColours.size() ? " stroke-dasharray=\"6 4\"" : "");
}

// A tick at every x that occurs, except those too close to the previous one.
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
    if (x.At(value) - last > 44) {  // pixels, the width of a label
      last = x.At(value);
      text += svg::Line(last, kPanelTop, last, kAxisBottom, "#dfe3e8", 1);
      text += svg::Text(last, kAxisBottom + 20, fmt::format("{:.4g}", value), "middle");
    }
  }
  return text;
}

std::string YTicks(double low, double high, double step, const Scale& y) {
  std::string text;
  for (int n = 0; low + n * step <= high + 1e-9 * step; ++n) {
    const double value = low + n * step, at = y.At(value);
    text += svg::Line(kPanelLeft, at, kPanelWidth - kPanelRight, at, "#dfe3e8", 1);
    text += svg::Text(kPanelLeft - 8, at + 5, fmt::format("{:.6g}", value), "end");
  }
  return text;
}

// The limits of all points.
struct AxisRanges {
  AxisLimits across, up;
};

// Sorts each line's points by x.
AxisRanges FindRanges(std::vector<AxisLine>& lines) {
  AxisRanges ranges;
  for (AxisLine& line : lines) {
    std::ranges::stable_sort(line.points, {}, &AxisPoint::x);
    for (const AxisPoint& p : line.points) {
      ranges.across.Include(p.x);
      ranges.up.Include(p.y);
    }
  }
  if (!(ranges.across.low <= ranges.across.high)) {
    ranges = {{0, 1}, {0, 1}};
  }
  return ranges;
}

// The n-th line with its points, and its row in the legend.
std::string LineSvg(const AxisLine& line, const Scale& x, const Scale& y, std::size_t n) {
  const char* const colour = svg::kColours[n % svg::kColours.size()];
  std::string text = line.is_joined ? AxisPolyline(line, x, y, n) : "";
  for (const AxisPoint& p : line.points) {
    text += svg::Dot(x.At(p.x), y.At(p.y), 5, p.name, colour);
  }
  const double at = kAxisBottom + 68 + 22 * static_cast<double>(n);
  text += line.is_joined ? svg::Line(kPanelLeft, at, kPanelLeft + 26, at, colour, 3)
                         : svg::Dot(kPanelLeft + 13, at, 5, "", colour);
  return text + svg::Text(kPanelLeft + 34, at + 5, svg::Shortened(line.label), "start");
}

}  // namespace

std::string AxisPlotSvg(std::vector<AxisLine> lines, const std::string& x_label,
                        const std::string& y_label) {
  const std::size_t left_out = lines.size() - std::min(lines.size(), kLargestLineCount);
  lines.resize(lines.size() - left_out);
  const auto [across, up] = FindRanges(lines);
  double low = up.low >= 0 && up.low < 0.5 * up.high ? 0 : up.low;
  double high = up.high > low ? up.high : low + 1;
  const double step = TickStep(low, high, 6);
  low = step * std::floor(low / step);
  high = step * std::ceil(high / step);
  const bool logarithmic = across.low > 0 && across.high > 20 * across.low;
  const Scale x(across.low, across.high, logarithmic, kPanelLeft + 20,
                kPanelWidth - kPanelRight - 20),
      y(low, high, /*logarithmic=*/false, kAxisBottom, kPanelTop);
  const double legend = 22 * static_cast<double>(lines.size() + (left_out > 0 ? 1 : 0));
  std::string text = svg::Open(kAxisBottom + 64 + legend, kPanelWidth) + XTicks(lines, x) +
                     YTicks(low, high, step, y) + svg::Text(8, 20, y_label, "start") +
                     svg::Text((kPanelLeft + kPanelWidth - kPanelRight) / 2, kAxisBottom + 44,
                               x_label + (logarithmic ? " (logarithmic)" : ""), "middle");
  for (std::size_t n = 0; n < lines.size(); ++n) {
    text += LineSvg(lines[n], x, y, n);
  }
  if (left_out > 0) {
    text += svg::Text(kPanelLeft, kAxisBottom + 73 + 22 * static_cast<double>(lines.size()),
                      fmt::format("and {} more, not drawn", left_out), "start");
  }
  return text + "</svg>\n";
}

// ---------------------------------------------------------------------------------------------
// Histogram of distances
// ---------------------------------------------------------------------------------------------

namespace {

constexpr double kBarsLeft = 70, kBarsBottom = 300;  // pixels
constexpr int kBars = 48;

struct BarRange {
  double high = 1;
  bool is_cut = false;  // larger values exist
};

// Computes the quantile only if enough values are small, because sorting many values is slow.
BarRange FindBarRange(std::span<const double> values) {
  // An axis up to 2.5 times the 95th percentile keeps the bulk readable when a few values are huge.
  constexpr double kReach = 2.5, kBulk = 0.95;
  if (values.empty()) {
    return {};
  }
  const double largest = *std::ranges::max_element(values);
  const auto small = std::ranges::count_if(values, [&](double v) { return kReach * v < largest; });
  double most = largest;
  if (static_cast<double>(small) >= kBulk * static_cast<double>(values.size())) {
    std::vector<double> in_order(values.begin(), values.end());
    most = Quantile(in_order, kBulk);
  }
  const bool is_cut = most > 0 && kReach * most < largest;
  const double high = is_cut ? kReach * most : largest;
  return {.high = high > 0 ? high : 1, .is_cut = is_cut};
}

std::vector<std::size_t> CountBars(const std::vector<double>& values, double high) {
  std::vector<std::size_t> counts(kBars, 0);
  for (const double value : values) {
    // The index is clamped as a floating-point number, because it may not fit an integer.
    ++counts[static_cast<std::size_t>(std::min(kBars - 1.0, value / high * kBars))];
  }
  return counts;
}

double BarX(double value, double high) {
  return kBarsLeft + value / high * (kPanelWidth - kBarsLeft - kPanelRight);
}

// `row` is the row of the label, so that labels do not overlap.
std::string MarkSvg(const HistogramMark& mark, double high, int row) {
  if (!std::isfinite(mark.value)) {
    return {};
  }
  const bool beyond = mark.value > high;
  const double x = BarX(std::min(mark.value, high), high);
  const bool right = x > kPanelWidth / 2;
  return svg::Line(x, kPanelTop - 14, x, kBarsBottom, "#d55e00", 2) +
         svg::Text(x + (right ? -6 : 6), kPanelTop + 16 * row,
                   fmt::format("{} {:.3g}{}", mark.label, mark.value, beyond ? " →" : ""),
                   right ? "end" : "start");
}

}  // namespace

std::string HistogramSvg(std::span<const double> values, const std::vector<HistogramMark>& marks,
                         const std::string& axis_label) {
  std::vector<double> counted;
  std::ranges::copy_if(values, std::back_inserter(counted),
                       [](double v) { return v >= 0 && std::isfinite(v); });
  const BarRange range = FindBarRange(counted);
  const std::vector<std::size_t> counts = CountBars(counted, range.high);
  const auto most =
      static_cast<double>(std::max<std::size_t>(1, *std::ranges::max_element(counts)));
  const auto x = [&](double v) { return BarX(v, range.high); };
  std::string text = svg::Open(kBarsBottom + 60, kPanelWidth);
  for (int k = 0; k < kBars; ++k) {
    const double low = range.high * k / kBars, high = range.high * (k + 1) / kBars;
    const double height = static_cast<double>(counts[k]) / most * (kBarsBottom - kPanelTop);
    text += fmt::format(
        "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
        "fill=\"#0072b2\">{}</rect>\n",
        x(low), kBarsBottom - height, x(high) - x(low) - 1, height,
        svg::Title(fmt::format("{:.3g} to {:.3g}: {}", low,
                               range.is_cut && k + 1 == kBars ? INFINITY : high, counts[k])));
  }
  text += svg::Line(kBarsLeft, kBarsBottom, kPanelWidth - kPanelRight, kBarsBottom, "#9aa4af", 1);
  const double step = TickStep(0, range.high, 6);
  for (int n = 0; n * step <= range.high * (1 + 1e-9); ++n) {
    text += svg::Text(x(n * step), kBarsBottom + 20, fmt::format("{:.6g}", n * step), "middle");
  }
  for (std::size_t k = 0; k < marks.size(); ++k) {
    text += MarkSvg(marks[k], range.high, static_cast<int>(k));
  }
  return text +
         svg::Text((kBarsLeft + kPanelWidth - kPanelRight) / 2, kBarsBottom + 46,
                   axis_label + (range.is_cut ? "; the last bar holds all beyond it" : ""),
                   "middle") +
         "</svg>\n";
}

}  // namespace semblance::problems
