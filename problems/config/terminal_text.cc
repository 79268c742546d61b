// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/terminal_text.h"

#include <cstddef>

namespace semblance::problems {

std::string ForTerminal(std::string_view text) {
  std::string result;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const auto c = static_cast<unsigned char>(text[k]);
    const auto next = k + 1 < text.size() ? static_cast<unsigned char>(text[k + 1]) : 0;
    const bool latin = c == 0xC2 && next >= 0x80 && next < 0xA0;  // U+0080 to U+009F
    result.push_back(latin || (c < 0x20 && c != '\n') || c == 0x7F ? '?' : text[k]);
    k += latin ? 1 : 0;
  }
  return result;
}

std::string QuotedForShell(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) {
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return quoted + "'";
}

}  // namespace semblance::problems
