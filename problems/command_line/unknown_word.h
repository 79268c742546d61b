// SPDX-License-Identifier: GPL-3.0-or-later
// What a mistyped command or option may have meant.
#pragma once

#include <span>
#include <string>

#include "problems/command_line/command_tree.h"

namespace semblance {

// words: a line that was refused, without the program's name. The first of them that is no command
// where one is expected, or no option of its command, in a sentence with the nearest that there
// is. Empty where all words are known.
std::string UnknownWord(const CommandNode& program, std::span<const std::string> words);

}  // namespace semblance
