// SPDX-License-Identifier: GPL-3.0-or-later
// The commands that work on one subject or folder: run, depth, import-ct, check, options, evaluate,
// report.
#pragma once

#include <span>

#include "problems/command_line/commands.h"

namespace semblance {

std::span<const ProgramCommand> RunCommands();

}  // namespace semblance
