// SPDX-License-Identifier: GPL-3.0-or-later
// The commands that work on a study: study, merge, status, submit.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <stop_token>

namespace semblance {

// Adds them to the program; the one that is named on the line sets `chosen`, which returns the exit
// code. stop: ends a study after the trials at hand.
void DeclareStudyCommands(CLI::App& app, std::stop_token stop, std::function<int()>& chosen);

}  // namespace semblance
