// SPDX-License-Identifier: GPL-3.0-or-later
// What people see while a long step runs.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

#include "surfaces/base/run_context.h"

namespace semblance {

// Prints events as lines to a stream: the first and last of each step, and between them at most one
// every `interval`.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(std::FILE* stream,
                           std::chrono::milliseconds interval = std::chrono::seconds(2));
  void operator()(const Event& event);

 private:
  using Clock = std::chrono::steady_clock;
  std::FILE* stream_;
  std::chrono::milliseconds interval_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_ = {};
  std::string last_step_;
};

}  // namespace semblance
