// SPDX-License-Identifier: GPL-3.0-or-later
// Makes texts that come from files safe for a terminal, for JSON and HTML, and for a shell.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>

namespace semblance::problems {

// Replaces every character of a text by '?' for which ControlsText (utf8_check.h) holds, except
// line feeds, so that no text of a file controls the terminal.
std::string ForTerminal(std::string_view text);

// The same for JSON and HTML, where line feeds and tabs stay.
std::string PlainText(std::string_view text);

// The same JSON with plain texts and keys, so that it can be written as UTF-8.
nlohmann::ordered_json WithPlainTexts(const nlohmann::ordered_json& json);

// Quotes any text as one word for a POSIX shell.
std::string QuotedForShell(std::string_view text);

// Prints a text whose values may come from files, such as names of subjects, through ForTerminal.
template <class... Values>
void Tell(std::FILE* to, fmt::format_string<Values...> words, Values&&... values) {
  fmt::print(to, "{}", ForTerminal(fmt::format(words, std::forward<Values>(values)...)));
}
template <class... Values>
void Tell(fmt::format_string<Values...> words, Values&&... values) {
  Tell(stdout, words, std::forward<Values>(values)...);
}

}  // namespace semblance::problems
