// SPDX-License-Identifier: GPL-3.0-or-later
// The command line. Exit codes: 0 done, 1 ran but the result is not usable, 2 bad input.
#include <fmt/format.h>
#include <glog/logging.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "problems/command_line/command_tree.h"
#include "problems/command_line/exit_code.h"
#include "problems/program/face_commands.h"
#include "problems/program/failure.h"
#include "problems/program/fit_command.h"
#include "problems/program/landmark_commands.h"
#include "problems/program/phantom_commands.h"
#include "problems/program/population_command.h"
#include "problems/program/run_commands.h"
#include "problems/program/shell_commands.h"
#include "problems/program/stop_signals.h"
#include "problems/program/study_commands.h"
#include "problems/program/template_commands.h"
#include "problems/program/workbench_command.h"

namespace semblance {
namespace {

int Complain(const std::string& words, int exit_code) {
  std::fputs(("semblance: " + words + "\n").c_str(), stderr);
  return exit_code;
}

// What does not reach its reader was not done.
int Flushed(int exit_code) {
  std::cout.flush();
  const bool all_written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
  return all_written ? exit_code
                     : Complain("the standard output cannot be written; is the disk full?",
                                exit_code == kDone ? kNotUsable : exit_code);
}

int ParseAndRun(int argc, char** argv) {
  CLI::App app("Recovers a face from a skull, and compares the ways of doing so.", "semblance");
  app.set_version_flag("--version", "semblance " SEMBLANCE_VERSION);
  app.require_subcommand(1);
  CommandLine line{.stop = StopOnSignals(), .chosen = {}};
  for (const auto& commands : {RunCommands(), FitCommands(), StudyCommands(), FaceCommands(),
                               LandmarkCommands(), TemplateCommands(), PopulationCommands(),
                               PhantomCommands(), WorkbenchCommands(), ShellCommands()}) {
    Declare(commands, app, line);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {
    return app.exit(e) == 0 ? kDone : kBadInput;
  } catch (const CLI::ParseError& e) {
    const std::string unknown =
        UnknownWord(TreeOf(app), std::vector<std::string>(argv + 1, argv + argc));
    return Complain(
        Shortened(fmt::format("{}; --help tells more", unknown.empty() ? e.what() : unknown)),
        kBadInput);
  }
  if (const std::string words = OptionWithoutValue(app); !words.empty()) {
    return Complain(words, kBadInput);
  }
  return line.chosen();
}

// Ceres warns through glog of what its results tell, e.g. of a cost without a slope. Only what ends
// the program anyway is let through: glog writes to the standard error output, also with --quiet.
void SilenceLibraries() { FLAGS_minloglevel = google::GLOG_FATAL; }

// Runs before the constructors of the shared libraries, in which memory can run out already.
void BeforeLibraries() { std::set_terminate(&EndInWords); }

int Main(int argc, char** argv) {
  SilenceLibraries();
  try {
    return Flushed(ParseAndRun(argc, argv));
  } catch (...) {
    if (std::ferror(stdout) != 0) {
      return Flushed(kNotUsable);
    }
    const Failure failure = FailureOf(std::current_exception());
    std::fflush(stdout);
    return Complain(failure.words, failure.exit_code);
  }
}

}  // namespace

[[gnu::section(".preinit_array"), gnu::used]] void (*const kBeforeLibraries)() = &BeforeLibraries;

}  // namespace semblance

int main(int argc, char** argv) { return semblance::Main(argc, argv); }
