// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/program.h"

#include <fmt/format.h>
#include <glog/logging.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <exception>
#include <iostream>
#include <span>
#include <string>
#include <vector>

#include "problems/app/all_commands.h"
#include "problems/app/command_tree.h"
#include "problems/app/exit_code.h"
#include "problems/app/program_end.h"
#include "problems/app/shell_completion.h"

namespace semblance::problems {
namespace {

int PrintError(const std::string& message, int exit_code) {
  std::fputs(("semblance: " + message + "\n").c_str(), stderr);
  return exit_code;
}

// Output that could not be flushed counts as a failure.
int FlushOutput(int exit_code) {
  std::cout.flush();
  const bool all_written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
  return all_written ? exit_code
                     : PrintError("the standard output cannot be written; is the disk full?",
                                  exit_code == kDone ? kNotUsable : exit_code);
}

// ---------------------------------------------------------------------------------------------
// The commands completion and manual, which describe the declared commands
// ---------------------------------------------------------------------------------------------

struct ShellArguments {
  const CLI::App* command = nullptr;
  std::string shell;
};

CommandNode WholeProgram(const ShellArguments& a) {
  return MakeCommandTree(*a.command->get_parent());
}

int Print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  return kDone;
}

int Completion(const ShellArguments& a) {
  const CommandNode program = WholeProgram(a);
  return Print(a.shell == "bash"  ? BashCompletion(program)
               : a.shell == "zsh" ? ZshCompletion(program)
                                  : FishCompletion(program));
}

int Manual(const ShellArguments& a) { return Print(ManualPage(WholeProgram(a))); }

void DeclareCompletion(CLI::App& completion, CommandLine& line) {
  ShellArguments& a = *Bind(completion, line, &Completion);
  a.command = &completion;
  completion.add_option("SHELL", a.shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
}

void DeclareManual(CLI::App& manual, CommandLine& line) {
  Bind(manual, line, &Manual)->command = &manual;
}

std::span<const ProgramCommand> ShellCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"completion",
                     "print a script that makes a shell complete the commands and options",
                     &DeclareCompletion},
      ProgramCommand{"manual", "print the manual page, for man -l -", &DeclareManual},
  };
  return kCommands;
}

// ---------------------------------------------------------------------------------------------
// The command line
// ---------------------------------------------------------------------------------------------

int ParseAndRun(int argc, char** argv) {
  CLI::App app("Recovers a face from a skull, and compares methods of doing so.", "semblance");
  app.set_version_flag("--version", "semblance " SEMBLANCE_VERSION);
  app.require_subcommand(1);
  CommandLine line{.stop = StopOnSignals(), .chosen = {}};
  for (const auto& commands :
       {RunCommands(), FitCommands(), StudyCommands(), RaterCommands(), FaceCommands(),
        LandmarkCommands(), TemplateCommands(), PopulationCommands(), PhantomCommands(),
        WorkbenchCommands(), ShellCommands()}) {
    Declare(commands, app, line);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {
    return app.exit(e) == 0 ? kDone : kBadInput;
  } catch (const CLI::ParseError& e) {
    const std::string unknown =
        UnknownWord(MakeCommandTree(app), std::vector<std::string>(argv + 1, argv + argc));
    return PrintError(
        Shortened(fmt::format("{}; see --help", unknown.empty() ? e.what() : unknown)), kBadInput);
  }
  if (const std::string fault = OptionWithoutValue(app); !fault.empty()) {
    return PrintError(fault, kBadInput);
  }
  return line.chosen();
}

// Silences glog, which Ceres uses for warnings that its results contain too, e.g. of a zero
// gradient. glog would print them to the standard error output even with --quiet. Fatal messages
// stay.
void SilenceLibraries() { FLAGS_minloglevel = google::GLOG_FATAL; }

}  // namespace

int RunProgram(int argc, char** argv) {
  SilenceLibraries();
  try {
    return FlushOutput(ParseAndRun(argc, argv));
  } catch (...) {
    if (std::ferror(stdout) != 0) {
      return FlushOutput(kNotUsable);
    }
    const Failure failure = DescribeFailure(std::current_exception());
    std::fflush(stdout);
    return PrintError(failure.words, failure.exit_code);
  }
}

}  // namespace semblance::problems
