// SPDX-License-Identifier: GPL-3.0-or-later
// A number against a number, as an SVG file.
#pragma once

#include <string>
#include <vector>

namespace semblance {

struct AxisPoint {
  double x = 0, y = 0;
  std::string name;  // for the pointer that rests on it
};

// A line through its points, in the order of x.
struct AxisLine {
  std::string label;
  std::vector<AxisPoint> points;
  bool is_joined = true;  // else its points alone
};

// x is spread by its logarithm where all x are above 0 and the largest is over 20 times the
// smallest. The vertical axis starts at 0 where the values come near it. Lines beyond the twelfth
// are left out, and said.
std::string AxisPlotSvg(std::vector<AxisLine> lines, const std::string& x_label,
                        const std::string& y_label);

}  // namespace semblance
