// SPDX-License-Identifier: GPL-3.0-or-later
// The manual page.
#pragma once

#include <string>

#include "problems/command_line/command_tree.h"

namespace semblance {

// In troff's man macros: a section of all commands, each with its options.
std::string ManualPage(const CommandNode& program);

}  // namespace semblance
