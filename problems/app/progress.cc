// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/progress.h"

#include <fmt/format.h>

#include <cmath>

namespace semblance::problems {
namespace {

std::string Line(const Event& event, double elapsed_s) {
  std::string line = fmt::format("[{:7.1f} s] {}", elapsed_s, event.step);
  if (std::isfinite(event.fraction)) {
    line += fmt::format(" {:3.0f} %", 100 * event.fraction);
  }
  if (!event.message.empty()) {
    line += ": " + event.message;
  }
  return line + "\n";
}

}  // namespace

ProgressPrinter::ProgressPrinter(std::FILE* stream, std::chrono::milliseconds interval)
    : stream_(stream), interval_(interval) {}

void ProgressPrinter::operator()(const Event& event) {
  const Clock::time_point now = Clock::now();
  const bool is_too_soon = event.step == last_step_ && event.message.empty() &&
                           now - last_ < interval_ && !(event.fraction >= 1);
  if (is_too_soon) {
    return;
  }
  last_step_ = event.step;
  last_ = now;
  std::fputs(Line(event, std::chrono::duration<double>(now - start_).count()).c_str(), stream_);
  std::fflush(stream_);
}

}  // namespace semblance::problems
