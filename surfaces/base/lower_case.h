// SPDX-License-Identifier: GPL-3.0-or-later
// Lower case, for file endings and option names that ignore case.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

// Changes ASCII letters to lower case and leaves all other bytes unchanged.
inline std::string LowerCase(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace semblance::surfaces
