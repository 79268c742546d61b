// SPDX-License-Identifier: GPL-3.0-or-later
// How often values of each size occur, as an SVG file.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace semblance {

// A line down the plot at a value, with a word to it.
struct HistogramMark {
  double value = 0;
  std::string label;
};

// Bars of equal width from 0 to the largest value; values below 0, NaN and infinity are not
// counted. Where the largest is more than 2.5 times the 95th percentile, the axis ends there: what
// lies beyond is in the last bar, and the axis says so. A mark beyond the end stands at it, with an
// arrow.
std::string HistogramSvg(std::span<const double> values, const std::vector<HistogramMark>& marks,
                         const std::string& axis_label);

}  // namespace semblance
