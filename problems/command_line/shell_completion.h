// SPDX-License-Identifier: GPL-3.0-or-later
// What completes commands, options and files in a shell.
#pragma once

#include <string>

#include "problems/command_line/command_tree.h"

namespace semblance {

std::string BashCompletion(const CommandNode& program);
std::string ZshCompletion(const CommandNode& program);
std::string FishCompletion(const CommandNode& program);

}  // namespace semblance
