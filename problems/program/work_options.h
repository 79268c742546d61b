// SPDX-License-Identifier: GPL-3.0-or-later
// What most commands take: what is laid over the configuration, where the results go, how many
// threads there are and who is told of progress.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "problems/command_line/commands.h"
#include "problems/output/staged_folder.h"
#include "surfaces/base/run_context.h"

namespace semblance {

struct WorkOptions {
  std::vector<std::string> overrides;
  std::string out;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  bool force = false, quiet = false;
  std::stop_token stop;
};

// --set
void AddSet(CLI::App& command, WorkOptions& options);
// --out and --force
void AddOutput(CLI::App& command, WorkOptions& options);
// --threads and --quiet
void AddWork(CLI::App& command, CommandLine& line, WorkOptions& options);

RunContext ContextOf(const WorkOptions& options);
StagedFolder FolderOf(const WorkOptions& options, const std::string& default_out);

// The exit code of a result with these faults.
int TellFaults(const std::vector<std::string>& faults);

}  // namespace semblance
