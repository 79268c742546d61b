// SPDX-License-Identifier: GPL-3.0-or-later
// For words of files and options, in which case does not count.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace semblance {

// Letters of ASCII in lower case, all other bytes as they are.
inline std::string LowerCase(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace semblance
