// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/stop_signals.h"

#include <unistd.h>

#include <csignal>
#include <string_view>

#include "problems/command_line/exit_code.h"

namespace semblance {
namespace {

constexpr unsigned kGrace_s = 1;

std::stop_source& StopSource() {
  // A signal handler has no other way in. Never destroyed: a signal may come as the program ends.
  static std::stop_source& source = *new std::stop_source;
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
  static volatile std::sig_atomic_t asked = 0;
  if (asked != 0) {
    EndAtOnce(0);
  }
  asked = 1;
  ::alarm(kGrace_s);  // before what may wait for a lock that the interrupted code holds
  StopSource().request_stop();
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
