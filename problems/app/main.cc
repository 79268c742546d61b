// SPDX-License-Identifier: GPL-3.0-or-later
// The program `semblance`. Exit codes: 0 done, 1 ran but the result is not usable, 2 bad input.
#include <exception>

#include "problems/app/program.h"
#include "problems/app/program_end.h"

namespace semblance::problems {
namespace {

// Runs before the constructors of the shared libraries, which may run out of memory.
void BeforeLibraries() { std::set_terminate(&TerminateWithMessage); }

}  // namespace

[[gnu::section(".preinit_array"), gnu::used]] void (*const kBeforeLibraries)() = &BeforeLibraries;

}  // namespace semblance::problems

int main(int argc, char** argv) { return semblance::problems::RunProgram(argc, argv); }
