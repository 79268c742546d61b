// SPDX-License-Identifier: GPL-3.0-or-later
// Calls of `semblance` as a user makes them, and what they cost.
#pragma once

#include <cmath>
#include <string>
#include <vector>

namespace semblance::bench {

struct CallCost {
  double cpu_s = NAN;    // user and system, of all threads
  double peak_mb = NAN;  // the most memory held in RAM
};

// NaN where the program fails.
CallCost CallProgram(const std::vector<std::string>& arguments);

// The call with the median of processor seconds, of three.
CallCost MedianCall(const std::vector<std::string>& arguments);

}  // namespace semblance::bench
