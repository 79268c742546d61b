// SPDX-License-Identifier: GPL-3.0-or-later
// The command that works on any scattered points: fit.
#pragma once

#include <span>

#include "problems/command_line/commands.h"

namespace semblance {

std::span<const ProgramCommand> FitCommands();

}  // namespace semblance
