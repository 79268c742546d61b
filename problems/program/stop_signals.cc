// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/stop_signals.h"

#include <unistd.h>

#include <csignal>
#include <string_view>

#include "problems/program/exit_code.h"

namespace semblance {
namespace {

constexpr unsigned kGrace_s = 1;

std::stop_source& StopSource() {
  static std::stop_source source;  // a signal handler has no other way in
  return source;
}

// Only what is allowed in a signal handler.
void EndAtOnce(int) {
  constexpr std::string_view kWords =
      "semblance: stopped; no run was written, and the finished trials of a study are kept\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kWords.data(), kWords.size());
  ::_exit(kNotUsable);
}

void Stop(int) {
  if (!StopSource().request_stop()) {
    EndAtOnce(0);
  }
  ::alarm(kGrace_s);
}

void Handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  ::sigaction(signal, &action, nullptr);
}

bool IsIgnored(int signal) {
  struct sigaction action {};
  return ::sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

}  // namespace

std::stop_token StopOnSignals() {
  const std::stop_token token = StopSource().get_token();  // made before a handler can ask for it
  Handle(SIGALRM, &EndAtOnce);
  Handle(SIGTERM, &Stop);
  Handle(SIGXFSZ, SIG_IGN);  // a file that grows beyond `ulimit -f` is then told like a full disk
  if (!IsIgnored(SIGINT)) {
    Handle(SIGINT, &Stop);
  }
  return token;
}

void EndInOwnTime() { ::alarm(0); }

}  // namespace semblance
