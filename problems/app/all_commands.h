// SPDX-License-Identifier: GPL-3.0-or-later
// The tables of commands. Each is defined in a separate file, e.g. FaceCommands in
// face_commands.cc; program.cc declares all of them.
#pragma once

#include <span>

#include "problems/app/commands.h"

namespace semblance::problems {

std::span<const ProgramCommand> RunCommands();         // run, depth, import-ct, check, options ...
std::span<const ProgramCommand> FitCommands();         // fit: any scattered points
std::span<const ProgramCommand> StudyCommands();       // study, submit, merge, compare, status
std::span<const ProgramCommand> RaterCommands();       // raters
std::span<const ProgramCommand> FaceCommands();        // edit, export, prior, feature
std::span<const ProgramCommand> LandmarkCommands();    // landmarks
std::span<const ProgramCommand> TemplateCommands();    // template, recentre
std::span<const ProgramCommand> PopulationCommands();  // population
std::span<const ProgramCommand> PhantomCommands();     // phantom
std::span<const ProgramCommand> WorkbenchCommands();   // workbench

}  // namespace semblance::problems
