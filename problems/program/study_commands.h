// SPDX-License-Identifier: GPL-3.0-or-later
// The commands that work on a study: study, submit, merge, compare, status.
#pragma once

#include <span>

#include "problems/command_line/commands.h"

namespace semblance {

std::span<const ProgramCommand> StudyCommands();

}  // namespace semblance
