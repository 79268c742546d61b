// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/fit_measure.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>  // program_invocation_short_name
#include <cmath>
#include <cstdio>

namespace semblance::bench {
using namespace problems;

double CpuSecondsSoFar() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double PeakMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

Measured MeasureApart(const std::function<Measured()>& here) {
  std::array<int, 2> ends{};
  Measured measured;
  if (pipe(ends.data()) != 0) {
    return measured;
  }
  const pid_t child = fork();
  if (child == 0) {
    measured = here();
    const bool sent = write(ends[1], &measured, sizeof measured) == sizeof measured;
    _exit(sent ? 0 : 1);
  }
  close(ends[1]);
  if (read(ends[0], &measured, sizeof measured) != sizeof measured) {
    measured = {};
  }
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return measured;
}

void Print(const std::string& name, double ours, double peer, double goal, const char* unit) {
  const double ratio = peer / ours;
  const bool met = std::isnan(peer) ? ours <= goal : ratio >= goal;
  const auto number = [](double x) {
    return !std::isfinite(x) ? "null" : fmt::format("{:.6g}", x);
  };
  fmt::print(
      "{{\"name\":\"{}\",\"ours\":{},\"peer\":{},\"ratio\":{},\"goal\":{},\"met\":{},\"unit\":\"{}"
      "\",\"command\":\"{}\"}}\n",
      name, number(ours), number(peer), number(ratio), number(goal),
      std::isnan(goal) ? "null" : (met ? "true" : "false"), unit, program_invocation_short_name);
  std::fflush(stdout);
}

}  // namespace semblance::bench
