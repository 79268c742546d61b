// SPDX-License-Identifier: GPL-3.0-or-later
// Texts that come from files, on a terminal and in a shell.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace semblance {

// The text with its lines, and '?' for every other control character (those of U+0080 to U+009F
// too), so that no name can drive the terminal.
std::string ForTerminal(std::string_view text);

// The text as one word for a POSIX shell, whatever is in it.
std::string QuotedForShell(std::string_view text);

// Prints a line whose values may come from files, such as names of subjects.
template <class... Values>
void Tell(fmt::format_string<Values...> words, Values&&... values) {
  fmt::print("{}", ForTerminal(fmt::format(words, std::forward<Values>(values)...)));
}

}  // namespace semblance
