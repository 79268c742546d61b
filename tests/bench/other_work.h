// SPDX-License-Identifier: GPL-3.0-or-later
// How much a machine did for other programs while something was measured.
#pragma once

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <fstream>
#include <string>

namespace semblance::bench {
using namespace problems;

// Counts from its making on, by the kernel's account of all processors less this program's own
// processor time.
class OtherWork {
 public:
  OtherWork() : start_(Clock::now()), all_s_(AllSeconds()), own_s_(OwnSeconds()) {}

  double WallSeconds() const {
    return std::chrono::duration<double>(Clock::now() - start_).count();
  }
  // Processors that others kept busy on the mean; NaN where the kernel keeps no account.
  double Processors() const {
    return ((AllSeconds() - all_s_) - (OwnSeconds() - own_s_)) / WallSeconds();
  }

 private:
  using Clock = std::chrono::steady_clock;

  static double OwnSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

  // Line 1 of /proc/stat: user, nice, system, idle, iowait, irq, softirq, steal, in clock ticks.
  static double AllSeconds() {
    std::ifstream file("/proc/stat");
    std::string name;
    double user = NAN, nice = NAN, system = NAN, idle = NAN, waiting = NAN, irq = NAN,
           softirq = NAN, steal = NAN;
    file >> name >> user >> nice >> system >> idle >> waiting >> irq >> softirq >> steal;
    return (user + nice + system + irq + softirq + steal) /
           static_cast<double>(sysconf(_SC_CLK_TCK));
  }

  Clock::time_point start_;
  double all_s_, own_s_;
};

}  // namespace semblance::bench
