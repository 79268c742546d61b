// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/plots/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "problems/metrics/statistics.h"
#include "problems/plots/svg_parts.h"

namespace semblance {
namespace {

using svg::kColours;
using svg::Line;
using svg::Open;
using svg::Shortened;
using svg::Text;

constexpr double kWidth = 900, kLabels = 330, kRight = 30;

// The axis of numbers at the foot of a plot.
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
      low_ = 0;  // lengths are seen against zero where it is near
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
    return svg + Text(MiddleOf(label), bottom + 44, label, "middle");
  }

 private:
  // That of the axis, unless the label then ran out of the picture.
  double MiddleOf(const std::string& label) const {
    const double middle = (left_ + kWidth - kRight) / 2;
    return std::max(kWidth / 2, std::min(middle, kWidth - svg::WidthOf(label) / 2));
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
    svg += semblance::svg::Dot(axis.At(row.values[k]), y, 4,
                               fmt::format("{}{:.6g}", name, row.values[k]));
  }
  return svg;
}

// The n-th line of a plot: its own colour, dashed where colours come round again.
std::string Polyline(const std::string& points, std::size_t n, const std::string& title = "") {
  return fmt::format(
      "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}>{}</polyline>\n",
      points, kColours[n % kColours.size()],
      n >= kColours.size() ? " stroke-dasharray=\"6 4\"" : "", svg::Title(title));
}

double LegendHeight(const std::vector<BoxRow>& rows) {
  return 22 * static_cast<double>((rows.size() + 1) / 2);
}

// Two columns of labels under a plot of lines.
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

// A plot of shares over an axis of numbers, without its lines.
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
    if (std::isfinite(critical_difference)) {  // what it cannot be told from
      double last = rank;
      for (const RankedLabel& other : treatments) {
        last =
            other.mean_rank - rank <= critical_difference ? std::max(last, other.mean_rank) : last;
      }
      svg += Line(at(rank), y, at(last), y, "#9aa4af", 3);
    }
    svg += fmt::format(
        "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"6\" fill=\"#0b5c8f\">{}</circle>\n", at(rank), y,
        semblance::svg::Title(fmt::format("{}: mean rank {:.3f}", treatments[n].label, rank)));
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

}  // namespace semblance
