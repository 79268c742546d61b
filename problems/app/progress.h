// SPDX-License-Identifier: GPL-3.0-or-later
// Progress lines of a long step on the terminal.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

#include "surfaces/base/run_context.h"

namespace semblance::problems {

// Prints events as lines to a stream: the first and last event of each step, and at most one per
// `interval` between them.
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

}  // namespace semblance::problems
