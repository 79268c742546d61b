// SPDX-License-Identifier: GPL-3.0-or-later
// The command phantom: a made-up head as the files that a real one comes in.
#pragma once

#include <span>

#include "problems/command_line/commands.h"

namespace semblance {

std::span<const ProgramCommand> PhantomCommands();

}  // namespace semblance
