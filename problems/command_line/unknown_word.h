// SPDX-License-Identifier: GPL-3.0-or-later
// What a mistyped command or option may have meant.
#pragma once

#include <span>
#include <string>

#include "problems/command_line/command_tree.h"

namespace semblance {

// The first word of a line that was refused (without the program's name) which is no command where
// one is due, or no option of its command, in a sentence with the nearest that there is; empty
// where all words are known.
std::string UnknownWord(const CommandNode& program, std::span<const std::string> words);

}  // namespace semblance
