// SPDX-License-Identifier: GPL-3.0-or-later
// The commands that work on landmarks alone: landmarks convert, landmarks propose.
#pragma once

#include <span>

#include "problems/command_line/commands.h"

namespace semblance {

std::span<const ProgramCommand> LandmarkCommands();

}  // namespace semblance
