// SPDX-License-Identifier: GPL-3.0-or-later
// Plots of numbers as SVG files.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace semblance::problems {

// One row of a plot.
struct BoxRow {
  std::string label;
  std::vector<double> values;           // in any order, unless the plot defines one
  std::vector<std::string> names = {};  // shown when the pointer rests on a value; or none
};

// Boxes above each other over one axis: quartiles, median, whiskers to the last value within 1.5
// times the box (Tukey 1977), and every value as a dot. A row without values shows a dash.
std::string BoxPlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// Mean ranks on a line, 1 (best) on the left, with the critical difference as a bar. A line joins
// treatments whose ranks differ by less (Demsar 2006).
struct RankedLabel {
  std::string label;
  double mean_rank = 0;
};
std::string RankPlotSvg(std::vector<RankedLabel> treatments, double critical_difference);

// The cumulative share of values below each value, one line per row.
std::string CumulativePlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// The same for rows of quantiles at even shares from 0 to 1, joined by straight lines. The axis
// ends at the last quantile but one (95 % of 21), because the very largest values would dwarf the
// rest.
std::string QuantilePlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// A number step by step, one line per row. The values of a row are those before the first step,
// after the first step, after the second step, and so on. The vertical axis starts at 0.
std::string ConvergencePlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// Observed against stated coverage. The values of a row are the shares observed within the
// intervals that should hold 1/(n+1), 2/(n+1), .. n/(n+1). A line on the diagonal is calibrated, a
// line below it is overconfident.
std::string CalibrationPlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// Small histograms next to each other, one per row, all at one scale. The values of a row are the
// shares in equal parts of 0..1. A grey line shows equal shares.
std::string HistogramsSvg(const std::vector<BoxRow>& rows);

struct AxisPoint {
  double x = 0, y = 0;
  std::string name;  // shown when the pointer rests on the point
};

// A line through its points in the order of x.
struct AxisLine {
  std::string label;
  std::vector<AxisPoint> points;
  bool is_joined = true;  // false: the points alone
};

// One number against another. The x axis is logarithmic if all x are above 0 and the largest is
// more than 20 times the smallest. The y axis starts at 0 if the values come near it. The plot
// draws twelve lines and states how many it leaves out.
std::string AxisPlotSvg(std::vector<AxisLine> lines, const std::string& x_label,
                        const std::string& y_label);

// A labelled vertical line of a histogram.
struct HistogramMark {
  double value = 0;
  std::string label;
};

// Bars of equal width from 0 to the largest value. Values below 0, NaN and infinity are not
// counted. If the largest value is more than 2.5 times the 95th percentile, the axis ends there,
// and the last bar holds all larger values. A mark beyond the end stands at the end, with an arrow.
std::string HistogramSvg(std::span<const double> values, const std::vector<HistogramMark>& marks,
                         const std::string& axis_label);

// A round step for about `count` ticks over [low, high]: 1, 2 or 5 times a power of ten.
double TickStep(double low, double high, int count);

}  // namespace semblance::problems
