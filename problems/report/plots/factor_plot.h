// SPDX-License-Identifier: GPL-3.0-or-later
// Means over the levels of factors, as SVG files.
#pragma once

#include <string>
#include <vector>

#include "problems/experiment/metrics/statistics.h"

namespace semblance::problems {

// A mean with its interval. The interval may be NaN.
struct PlottedMean {
  double mean = 0;
  Interval interval = {};
};

// The means of one panel: one line per level of the second factor, over the levels of the first.
struct FactorPanel {
  std::string heading;                          // the level of the third factor; may be empty
  std::vector<std::vector<PlottedMean>> lines;  // [line][level]
};

struct FactorPlot {
  std::string x_label, y_label;
  std::vector<std::string> levels;  // names along the x axis
  std::vector<double> positions;    // of the levels; logarithmic if they are numbers that span
                                    // more than a factor of 20
  std::vector<std::string> lines;   // names of the lines; may be one empty name
  std::vector<FactorPanel> panels;
};

// Lines through the means, with whiskers for the intervals: an interaction plot. Parallel lines
// mean that the effect of one factor does not depend on the other. Several panels share one y axis
// and stand two in a row. Draws twelve lines and six panels, and states how many it leaves out.
// Throws InputError unless each panel has one mean per line and level, and each level a position.
std::string FactorPlotSvg(const FactorPlot& plot);

// One row of a list of means.
struct PlottedLevel {
  std::string group;  // heading above the first row of the group; may be empty
  std::string label;
  PlottedMean mean;
};

// Means above each other over one axis, grouped by factor, as dots with their intervals.
std::string MeansPlotSvg(const std::vector<PlottedLevel>& rows, const std::string& axis_label);

}  // namespace semblance::problems
