// SPDX-License-Identifier: GPL-3.0-or-later
// What the program says and returns when something was thrown.
#pragma once

#include <exception>
#include <string>
#include <string_view>

namespace semblance {

struct Failure {
  int exit_code = -1;
  std::string words;  // without "semblance: ", as short as Shortened makes it
};

// Whatever it is: kBadInput for what the user can mend, kNotUsable for work that ran and could not
// end (memory, threads, a full standard output, a stop).
Failure FailureOf(const std::exception_ptr& thrown);

// A message for a terminal: each line at most 1,000 bytes and 50 lines, with how much was left out;
// control characters, which a hostile name can hold, as '?'.
std::string Shortened(std::string_view message);

// For std::set_terminate, before the work begins: what no catch can see, such as memory that runs
// out in a thread of a library, ends the program with its words and kNotUsable too.
[[noreturn]] void EndInWords() noexcept;

}  // namespace semblance
