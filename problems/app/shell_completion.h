// SPDX-License-Identifier: GPL-3.0-or-later
// Completion scripts for shells, and the manual page.
#pragma once

#include <string>

#include "problems/app/command_tree.h"

namespace semblance::problems {

// Each returns a script that completes commands, options and files.
std::string BashCompletion(const CommandNode& program);
std::string ZshCompletion(const CommandNode& program);
std::string FishCompletion(const CommandNode& program);

// Returns the manual page in troff's man macros, with a section of all commands and their options.
std::string ManualPage(const CommandNode& program);

}  // namespace semblance::problems
