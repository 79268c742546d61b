// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the named steps of a long job and records what each costs.
#pragma once

#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

struct StepTime {
  std::string step;
  double wall_s = kNaN;
  // The processor time of all threads of the process; in a job with one thread only of that thread,
  // because other jobs may run beside it.
  double cpu_s = kNaN;
  // The most memory that the process has held in RAM from its start to the end of the step. It is
  // not reset before a step, because a reset would hide the peak from the tools that watch the
  // process from outside.
  double peak_mb = kNaN;
};

[[noreturn]] void ThrowOutOfMemory(const char* step);

class StepClock {
 public:
  // `before` holds the earlier steps of the same job.
  explicit StepClock(const RunContext& context, std::vector<StepTime> before = {})
      : context_(context), times_(std::move(before)) {}

  // Reports the name, then returns step(). Throws Cancelled if a stop was requested. Throws
  // OutOfMemory, with a remedy, if step() needs more memory than there is.
  template <class Step>
  auto operator()(const char* name, Step&& step) {
    context_.ThrowIfStopped();
    context_.Report(name);
    const Recording recording(name, context_.threads, times_);
    return Guarded(name, std::forward<Step>(step));
  }
  std::vector<StepTime> Take() { return std::move(times_); }

 private:
  // Adds the step to `times` when it ends.
  class Recording {
   public:
    Recording(const char* name, int threads, std::vector<StepTime>& times);
    ~Recording();
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

   private:
    const char* name_;
    int threads_;
    std::vector<StepTime>& times_;
    double wall_start_s_, cpu_start_s_;
  };

  template <class Step>
  static auto Guarded(const char* name, Step&& step) {
    try {
      return step();
    } catch (const std::bad_alloc&) {
      ThrowOutOfMemory(name);
    } catch (const std::length_error&) {  // the size exceeds any memory
      ThrowOutOfMemory(name);
    }
  }

  const RunContext& context_;
  std::vector<StepTime> times_;
};

}  // namespace semblance::problems
