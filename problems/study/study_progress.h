// SPDX-License-Identifier: GPL-3.0-or-later
// How far a study has come, for people who wait for it.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

#include "surfaces/base/run_context.h"

namespace semblance {

// What is known of a study on its way. elapsed_s counts from when `finished_before` trials were
// done.
struct StudyEta {
  int trials = 0, finished = 0, finished_before = 0, failed = 0;
  double elapsed_s = 0;
};

// "12 of 80 trials, 4.6 s each, about 5 min left; 1 failed", without what is not known yet.
std::string EtaText(const StudyEta& eta);

// "[######......]", `width` characters between the brackets.
std::string BarText(const StudyEta& eta, int width);

// Shows how far a study is: on a terminal as a bar that is drawn over, otherwise as a line every
// `interval`, and at the end. A trial that failed has a line of its own.
class StudyProgress {
 public:
  explicit StudyProgress(std::FILE* stream,
                         std::chrono::milliseconds interval = std::chrono::seconds(5));
  ~StudyProgress();  // ends the line of a bar that has not come to its end
  StudyProgress(const StudyProgress&) = delete;
  StudyProgress& operator=(const StudyProgress&) = delete;

  // Any time. trial: the one that ended, subject, values and status; said alone where it failed.
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

}  // namespace semblance
