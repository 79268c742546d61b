// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>

#include "problems/config/terminal_text.h"

namespace semblance::problems {
namespace {

std::string Duration(double seconds) {
  if (seconds < 90) {
    return fmt::format("{:.0f} s", std::max(1.0, std::round(seconds)));
  }
  return seconds < 5400 ? fmt::format("{:.0f} min", seconds / 60)
                        : fmt::format("{:.1f} h", seconds / 3600);
}

// Ignores a stream that cannot be written: it must not stop a study.
void Put(std::FILE* stream, const std::string& text) { std::fputs(text.c_str(), stream); }

}  // namespace

std::string EtaText(const StudyEta& eta) {
  std::string text = fmt::format("{} of {} trials", eta.finished, eta.trials);
  const int here = eta.finished - eta.finished_before;
  if (here == 0 && eta.elapsed_s >= 1) {
    text += fmt::format(", {} so far", Duration(eta.elapsed_s));
  }
  if (here > 0 && eta.elapsed_s > 0) {
    const double each_s = eta.elapsed_s / here;
    text += each_s >= 1 ? fmt::format(", {:.1f} s each", each_s)
                        : fmt::format(", {:.1f} a second", 1 / each_s);
    if (eta.finished < eta.trials) {
      text += fmt::format(", about {} left", Duration(each_s * (eta.trials - eta.finished)));
    }
  }
  return text + (eta.failed > 0 ? fmt::format("; {} failed", eta.failed) : "");
}

std::string BarText(const StudyEta& eta, int width) {
  const int full = eta.trials > 0 ? width * eta.finished / eta.trials : width;
  return fmt::format("[{:#<{}}{:.<{}}]", "", full, "", width - full);
}

StudyProgress::StudyProgress(std::FILE* stream, std::chrono::milliseconds interval)
    : stream_(stream), is_terminal_(isatty(fileno(stream)) == 1), interval_(interval) {}

StudyProgress::~StudyProgress() {
  if (is_terminal_ && is_drawn_ && !is_over_) {
    Put(stream_, "\n");
  }
}

void StudyProgress::operator()(const StudyEta& eta, const std::string& trial) {
  constexpr const char* kClearLine = "\r\033[K";
  const bool is_last = eta.finished == eta.trials;
  if (is_over_) {
    return;
  }
  is_over_ = is_last;
  is_drawn_ = true;
  if (eta.failed > failed_) {
    failed_ = eta.failed;
    Put(stream_, fmt::format("{}{}\n", is_terminal_ ? kClearLine : "", ForTerminal(trial)));
  }
  if (is_terminal_) {
    Put(stream_,
        fmt::format("{}{} {}{}", kClearLine, BarText(eta, 30), EtaText(eta), is_last ? "\n" : ""));
  } else if (is_last || Clock::now() - last_ >= interval_) {
    last_ = Clock::now();
    Put(stream_, EtaText(eta) + "\n");
  }
  std::fflush(stream_);
}

}  // namespace semblance::problems
