// SPDX-License-Identifier: GPL-3.0-or-later
// The program `semblance` as a function.
#pragma once

namespace semblance::problems {

// Runs the command that the arguments name and returns its exit code (exit_code.h). Errors are
// printed on the standard error output. It is called once in a process, because it handles signals.
int RunProgram(int argc, char** argv);

}  // namespace semblance::problems
