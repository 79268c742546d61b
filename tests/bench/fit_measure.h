// SPDX-License-Identifier: GPL-3.0-or-later
// What fit_bench measures, and how: each case in a process of its own, so that its peak of memory
// is its own.
#pragma once

#include <functional>
#include <string>

#include "surfaces/base/geometry.h"

namespace semblance::bench {
using namespace problems;

struct Measured {
  double seconds = kNaN;
  double peak_mb = kNaN;
  double rms_mm = kNaN;
  double largest_mm = kNaN;  // of the head, against the clean surface, as rms_mm
  double vertices = kNaN;
};

// Of this process so far, user and system: what a loaded machine does not change much.
double CpuSecondsSoFar();
double PeakMb();

Measured MeasureApart(const std::function<Measured()>& here);

// One line of JSON. `ratio` is how many times less than the peer; met if it is at least the goal,
// or without a peer if ours is at most the goal.
void Print(const std::string& name, double ours, double peer, double goal, const char* unit);

}  // namespace semblance::bench
