// SPDX-License-Identifier: GPL-3.0-or-later
// The commands completion and manual: what a shell and `man` are told, from the declared commands.
#pragma once

#include <span>

#include "problems/command_line/commands.h"

namespace semblance {

std::span<const ProgramCommand> ShellCommands();

}  // namespace semblance
