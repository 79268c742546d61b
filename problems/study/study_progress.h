// SPDX-License-Identifier: GPL-3.0-or-later
// The progress of a study on the terminal.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

#include "surfaces/base/run_context.h"

namespace semblance::problems {

// The state of a running study. elapsed_s counts from the start of this call, when
// `finished_before` trials had finished.
struct StudyEta {
  int trials = 0, finished = 0, finished_before = 0, failed = 0;
  double elapsed_s = 0;
};

// Writes "12 of 80 trials, 4.6 s each, about 5 min left; 1 failed", without parts not known yet.
std::string EtaText(const StudyEta& eta);

// Draws "[######......]" with `width` characters between the brackets.
std::string BarText(const StudyEta& eta, int width);

// Shows the progress of a study: on a terminal as a bar that is redrawn, otherwise as a line every
// `interval` and at the end. Each failed trial gets a line of its own.
class StudyProgress {
 public:
  explicit StudyProgress(std::FILE* stream,
                         std::chrono::milliseconds interval = std::chrono::seconds(5));
  ~StudyProgress();  // ends the line of an unfinished bar
  StudyProgress(const StudyProgress&) = delete;
  StudyProgress& operator=(const StudyProgress&) = delete;

  // Call at any time. `trial` describes the trial that ended; it is shown only if the trial failed.
  void operator()(const StudyEta& eta, const std::string& trial);

 private:
  using Clock = std::chrono::steady_clock;
  std::FILE* stream_;
  bool is_terminal_;
  std::chrono::milliseconds interval_;
  bool is_over_ = false, is_drawn_ = false;
  int failed_ = 0;
  Clock::time_point last_ = Clock::now();
};

}  // namespace semblance::problems
