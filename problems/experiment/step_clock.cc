// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/step_clock.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <array>
#include <ctime>
#include <string_view>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

struct Remedy {
  std::string_view step, what;
};

// Remedies that reduce the memory of a step.
constexpr std::array kRemedies = {
    Remedy{"load subject", "give meshes or a volume with fewer elements"},
    Remedy{"fill skull", "give a skull with fewer triangles"},
    Remedy{"interpolate depth", "give a skull with fewer triangles"},
    Remedy{"implicit face", "lower implicit.resolution"},
    Remedy{"fit", "lower the finest level of fit.plan, or seeds.level"},
    Remedy{"uncertainty", "lower uncertainty.samples, or the finest level of fit.plan"},
};

double Seconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double Cpu_s(int threads) {
  return Seconds(threads > 1 ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_THREAD_CPUTIME_ID);
}

double PeakMemory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024e-6 * static_cast<double>(usage.ru_maxrss);  // Linux counts in KiB
}

}  // namespace

StepClock::Recording::Recording(const char* name, int threads, std::vector<StepTime>& times)
    : name_(name),
      threads_(threads),
      times_(times),
      wall_start_s_(Seconds(CLOCK_MONOTONIC)),
      cpu_start_s_(Cpu_s(threads)) {}

StepClock::Recording::~Recording() {
  times_.push_back({.step = name_,
                    .wall_s = Seconds(CLOCK_MONOTONIC) - wall_start_s_,
                    .cpu_s = Cpu_s(threads_) - cpu_start_s_,
                    .peak_mb = PeakMemory_mb()});
}

void ThrowOutOfMemory(const char* step) {
  std::string_view remedy = "give smaller meshes";
  for (const Remedy& known : kRemedies) {
    remedy = known.step == step ? known.what : remedy;
  }
  throw OutOfMemory(fmt::format(
      "not enough memory for the step '{}'; {}, or run fewer trials at a time", step, remedy));
}

}  // namespace semblance::problems
