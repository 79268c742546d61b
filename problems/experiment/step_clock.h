// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the named steps of a long job and records the duration of each.
#pragma once

#include <chrono>
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
};

[[noreturn]] void ThrowOutOfMemory(const char* step);

class StepClock {
 public:
  explicit StepClock(const RunContext& context) : context_(context) {}

  // Reports the name, then returns step(). Throws Cancelled if a stop was requested. Throws
  // OutOfMemory, with a remedy, if step() needs more memory than there is.
  template <class Step>
  auto operator()(const char* name, Step&& step) {
    context_.ThrowIfStopped();
    context_.Report(name);
    const auto start = std::chrono::steady_clock::now();
    auto value = Guarded(name, std::forward<Step>(step));
    times_.push_back(
        {name, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()});
    return value;
  }
  std::vector<StepTime> Take() { return std::move(times_); }

 private:
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
