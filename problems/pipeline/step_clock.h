// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the named steps of a long job and notes how long each took.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/run_context.h"

namespace semblance {

struct StepTime {
  std::string step;
  double wall_s = kNaN;
};

class StepClock {
 public:
  explicit StepClock(const RunContext& context) : context_(context) {}

  // What step() returns. Reports the name first; throws Cancelled if a stop was requested.
  template <class Step>
  auto operator()(const char* name, Step&& step) {
    context_.ThrowIfStopped();
    context_.Report(name);
    const auto start = std::chrono::steady_clock::now();
    auto value = step();
    times_.push_back(
        {name, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()});
    return value;
  }
  std::vector<StepTime> Take() { return std::move(times_); }

 private:
  const RunContext& context_;
  std::vector<StepTime> times_;
};

}  // namespace semblance
