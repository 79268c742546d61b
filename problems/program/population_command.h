// SPDX-License-Identifier: GPL-3.0-or-later
// The command that measures a population.
#pragma once

#include <span>

#include "problems/command_line/commands.h"

namespace semblance {

std::span<const ProgramCommand> PopulationCommands();

}  // namespace semblance
