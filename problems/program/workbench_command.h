// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance workbench`: from a skull to a face in a browser.
#pragma once

#include <span>

#include "problems/command_line/commands.h"

namespace semblance {

std::span<const ProgramCommand> WorkbenchCommands();

}  // namespace semblance
