// SPDX-License-Identifier: GPL-3.0-or-later
// Texts that come from files, on a terminal.
#pragma once

#include <string>
#include <string_view>

namespace semblance {

// The text with its lines, and '?' for every other control character (those of U+0080 to U+009F
// too), so that no name can drive the terminal.
std::string ForTerminal(std::string_view text);

}  // namespace semblance
