// SPDX-License-Identifier: GPL-3.0-or-later
// Early ends of the program: messages and exit codes of exceptions, Ctrl-C and SIGTERM.
#pragma once

#include <exception>
#include <stop_token>
#include <string>
#include <string_view>

namespace semblance::problems {

struct Failure {
  int exit_code = -1;
  std::string words;  // message without "semblance: ", shortened
};

// Accepts any exception. The exit code is kBadInput for faults that the user can correct, and
// kNotUsable for work that ran and failed (memory, threads, a full standard output, a stop).
Failure DescribeFailure(const std::exception_ptr& thrown);

// Shortens a message for a terminal to 50 lines of at most 1,000 bytes, and states how much was
// left out. Control characters, which the name of a file may contain, become '?'.
std::string Shortened(std::string_view message);

// Handler for std::set_terminate. An exception that no catch block can reach, such as lack of
// memory in a thread of a library, then ends the program with its message and kNotUsable too.
[[noreturn]] void TerminateWithMessage() noexcept;

// Installs the handlers. The first signal requests a stop through the token. If the program still
// runs a second later, it exits at once with kNotUsable; that loses nothing, because no file is
// ever half written and the next run removes temporary files. A second signal exits at once. If
// SIGINT is ignored, as in a background job, it stays ignored.
std::stop_token StopOnSignals();

// Removes the time limit of one second, for a command that has noticed the stop and needs longer to
// end. A second signal still exits at once.
void RemoveStopTimeout();

}  // namespace semblance::problems
