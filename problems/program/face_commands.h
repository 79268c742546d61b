// SPDX-License-Identifier: GPL-3.0-or-later
// The commands that work on one H-spline face: edit, export, feature.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace semblance {

// Adds them to the program; the one that is named on the line sets `chosen`, which returns the exit
// code.
void DeclareFaceCommands(CLI::App& app, std::function<int()>& chosen);

}  // namespace semblance
