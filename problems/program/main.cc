// SPDX-License-Identifier: GPL-3.0-or-later
// The command line. Exit codes: 0 done, 1 ran but the result is not usable, 2 bad input.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <stop_token>

#include "problems/program/exit_code.h"
#include "problems/program/face_commands.h"
#include "problems/program/landmark_commands.h"
#include "problems/program/run_commands.h"
#include "problems/program/study_commands.h"
#include "problems/program/template_commands.h"
#include "surfaces/base/error.h"
#include "surfaces/base/run_context.h"

namespace semblance {
namespace {

std::stop_source& StopSource() {
  static std::stop_source source;  // a signal handler has no other way in
  return source;
}

int Execute(const CommandLine& line) {
  try {
    return line.chosen();
  } catch (const Error& e) {
    fmt::print(stderr, "semblance: {}\n", e.what());
    return kBadInput;
  } catch (const Cancelled&) {
    fmt::print(
        stderr,
        "semblance: stopped; no run was written, and the finished trials of a study are kept\n");
    return kNotUsable;
  }
}

int Main(int argc, char** argv) {
  CLI::App app("Recovers a face from a skull, and compares the ways of doing so.", "semblance");
  app.set_version_flag("--version", "semblance " SEMBLANCE_VERSION);
  app.require_subcommand(1);
  CommandLine line{.stop = StopSource().get_token(), .chosen = {}};
  for (const auto& commands :
       {RunCommands(), StudyCommands(), FaceCommands(), LandmarkCommands(), TemplateCommands()}) {
    Declare(commands, app, line);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kBadInput;
  }
  return Execute(line);
}

}  // namespace
}  // namespace semblance

int main(int argc, char** argv) {
  const auto stop = [](int) { semblance::StopSource().request_stop(); };
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  return semblance::Main(argc, argv);
}
