// SPDX-License-Identifier: GPL-3.0-or-later
// One line of JSON per measurement, and the processor's time.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>

namespace semblance::bench {
using namespace problems;

struct Entry {
  std::string name;
  double ours = NAN, peer = NAN;
  double ratio = NAN;  // how many times better ours is
  double goal = NAN;   // of the ratio; of ours where there is no peer
  std::string unit = "s";
  bool at_most = false;  // met where ours is at most the goal
  bool busy = false;     // other programs kept the machine too busy to measure: no figures
};

inline void Print(const Entry& e, const std::string& command) {
  const double measured = std::isnan(e.ratio) ? e.ours : e.ratio;
  const bool met = e.at_most ? measured <= e.goal : measured >= e.goal;
  const auto number = [](double x) {
    return std::isnan(x) ? std::string("null") : fmt::format("{:.5g}", x);
  };
  const auto figure = [&](double x) { return number(e.busy ? NAN : x); };
  fmt::print(
      "{{\"name\": \"{}\", \"ours\": {}, \"peer\": {}, \"ratio\": {}, \"goal\": {}, \"met\": {}, "
      "\"unit\": \"{}\", \"command\": \"{}\"{}}}\n",
      e.name, figure(e.ours), figure(e.peer), figure(e.ratio), number(e.goal),
      std::isnan(e.goal) || e.busy ? "null" : (met ? "true" : "false"), e.unit, command,
      e.busy ? ", \"busy\": true" : "");
  std::fflush(stdout);
}

// Processor seconds of a call: what a machine without other work would show on one thread.
template <class Call>
double CpuSeconds(const Call& call) {
  const std::clock_t start = std::clock();
  call();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

}  // namespace semblance::bench
