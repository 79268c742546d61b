// SPDX-License-Identifier: GPL-3.0-or-later
// The commands that work on an H-spline face: edit, export, feature.
#pragma once

#include <span>

#include "problems/command_line/commands.h"

namespace semblance {

std::span<const ProgramCommand> FaceCommands();

}  // namespace semblance
