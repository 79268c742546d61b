// SPDX-License-Identifier: GPL-3.0-or-later
// Makes texts that come from files safe for a terminal and for a shell.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace semblance::problems {

// Replaces every control character except line feeds by '?', also U+0080 to U+009F, so that no name
// in a file can control the terminal.
std::string ForTerminal(std::string_view text);

// Quotes any text as one word for a POSIX shell.
std::string QuotedForShell(std::string_view text);

// Prints a line whose values may come from files, such as names of subjects, through ForTerminal.
template <class... Values>
void Tell(fmt::format_string<Values...> words, Values&&... values) {
  fmt::print("{}", ForTerminal(fmt::format(words, std::forward<Values>(values)...)));
}

}  // namespace semblance::problems
