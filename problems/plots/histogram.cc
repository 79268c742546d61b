// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/plots/histogram.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/plots/svg_parts.h"
#include "problems/plots/svg_plot.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

constexpr double kWidth = 720, kLeft = 70, kRight = 30, kTop = 40, kBottom = 300;
constexpr int kBars = 48;

struct Range {
  double high = 1;
  bool is_cut = false;  // values lie beyond
};

// The quantile is looked for only where so many are small that it can be.
Range RangeOf(std::span<const double> values) {
  constexpr double kReach = 2.5, kMost = 0.95;
  if (values.empty()) {
    return {};
  }
  const double largest = *std::ranges::max_element(values);
  const auto small = std::ranges::count_if(values, [&](double v) { return kReach * v < largest; });
  double most = largest;
  if (static_cast<double>(small) >= kMost * static_cast<double>(values.size())) {
    std::vector<double> in_order(values.begin(), values.end());
    most = Quantile(in_order, kMost);
  }
  const bool is_cut = most > 0 && kReach * most < largest;
  const double high = is_cut ? kReach * most : largest;
  return {.high = high > 0 ? high : 1, .is_cut = is_cut};
}

std::vector<std::size_t> Counts(const std::vector<double>& values, double high) {
  std::vector<std::size_t> counts(kBars, 0);
  for (const double value : values) {
    // In floating point: what lies far beyond has a bar that no whole number holds.
    ++counts[static_cast<std::size_t>(std::min(kBars - 1.0, value / high * kBars))];
  }
  return counts;
}

double XOf(double value, double high) { return kLeft + value / high * (kWidth - kLeft - kRight); }

// row: of the word beside the line, so that words do not lie on each other.
std::string MarkSvg(const HistogramMark& mark, double high, int row) {
  if (!std::isfinite(mark.value)) {
    return {};
  }
  const bool beyond = mark.value > high;
  const double x = XOf(std::min(mark.value, high), high);
  const bool right = x > kWidth / 2;
  return svg::Line(x, kTop - 14, x, kBottom, "#d55e00", 2) +
         svg::Text(x + (right ? -6 : 6), kTop + 16 * row,
                   fmt::format("{} {:.3g}{}", mark.label, mark.value, beyond ? " →" : ""),
                   right ? "end" : "start");
}

}  // namespace

std::string HistogramSvg(std::span<const double> values, const std::vector<HistogramMark>& marks,
                         const std::string& axis_label) {
  std::vector<double> counted;
  std::ranges::copy_if(values, std::back_inserter(counted),
                       [](double v) { return v >= 0 && std::isfinite(v); });
  const Range range = RangeOf(counted);
  const std::vector<std::size_t> counts = Counts(counted, range.high);
  const auto most =
      static_cast<double>(std::max<std::size_t>(1, *std::ranges::max_element(counts)));
  const auto x = [&](double v) { return XOf(v, range.high); };
  std::string text = svg::Open(kBottom + 60, kWidth);
  for (int k = 0; k < kBars; ++k) {
    const double low = range.high * k / kBars, high = range.high * (k + 1) / kBars;
    const double height = static_cast<double>(counts[k]) / most * (kBottom - kTop);
    text += fmt::format(
        "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
        "fill=\"#0072b2\">{}</rect>\n",
        x(low), kBottom - height, x(high) - x(low) - 1, height,
        svg::Title(fmt::format("{:.3g} to {:.3g}: {}", low,
                               range.is_cut && k + 1 == kBars ? INFINITY : high, counts[k])));
  }
  text += svg::Line(kLeft, kBottom, kWidth - kRight, kBottom, "#9aa4af", 1);
  const double step = TickStep(0, range.high, 6);
  for (int n = 0; n * step <= range.high * (1 + 1e-9); ++n) {
    text += svg::Text(x(n * step), kBottom + 20, fmt::format("{:.6g}", n * step), "middle");
  }
  for (std::size_t k = 0; k < marks.size(); ++k) {
    text += MarkSvg(marks[k], range.high, static_cast<int>(k));
  }
  return text +
         svg::Text((kLeft + kWidth - kRight) / 2, kBottom + 46,
                   axis_label + (range.is_cut ? "; the last bar holds all beyond it" : ""),
                   "middle") +
         "</svg>\n";
}

}  // namespace semblance
