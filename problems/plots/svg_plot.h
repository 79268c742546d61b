// SPDX-License-Identifier: GPL-3.0-or-later
// Plots of one number by row, as SVG files.
#pragma once

#include <string>
#include <vector>

namespace semblance {

// One row of a box plot: all its values, in any order.
struct BoxRow {
  std::string label;
  std::vector<double> values;
  std::vector<std::string> names = {};  // of the values, for the pointer that rests on one; or none
};

// Boxes side by side over one axis: quartiles, median, whiskers to the last value within 1.5 times
// the box (Tukey 1977), and every value as a dot. Rows without values show a dash.
std::string BoxPlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// Mean ranks on a line, 1 (best) on the left, with the critical difference as a bar; treatments
// that differ by less are joined (Demsar 2006).
struct RankedLabel {
  std::string label;
  double mean_rank = 0;
};
std::string RankPlotSvg(std::vector<RankedLabel> treatments, double critical_difference);

// The cumulative share of values below each, one line per row.
std::string CumulativePlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// The same for rows of quantiles at even shares from 0 to 1, as lines from one to the next. The
// axis ends at the last but one (95 % of 21): the very largest values would dwarf the rest.
std::string QuantilePlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// How a number falls step by step, one line per row: its values are those before the first step,
// after it, after the second ...; the vertical axis starts at 0.
std::string ConvergencePlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// How often stated uncertainties hold: row values are the shares observed within the intervals that
// should hold 1/(n+1), 2/(n+1), .. n/(n+1). On the diagonal the statement is right; below it, too
// bold.
std::string CalibrationPlotSvg(const std::vector<BoxRow>& rows, const std::string& axis_label);

// Small histograms side by side, one per row: its values are the shares in equal parts of 0..1. The
// grey line is where all would be equal; all have one scale.
std::string HistogramsSvg(const std::vector<BoxRow>& rows);

// A round step for about `count` ticks over [low, high]: 1, 2 or 5 times a power of ten.
double TickStep(double low, double high, int count);

}  // namespace semblance
