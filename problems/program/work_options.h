// SPDX-License-Identifier: GPL-3.0-or-later
// What most commands take: what is laid over the configuration, where the results go, how many
// threads there are and who is told of progress.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
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

// An option that takes one of some words; take(n) for the n-th of them.
CLI::Option* AddWords(CLI::App& command, const std::string& name, const std::string& description,
                      const std::vector<std::string>& words,
                      const std::function<void(std::size_t)>& take);

// One that takes a value of an enum, by its words in configurations (fields.h).
template <class E>
void AddChoice(CLI::App& command, const std::string& name, const std::string& description,
               E& value) {
  const auto words = EnumNames(E{});
  AddWords(command, name, description, {words.begin(), words.end()}, [&value](std::size_t n) {
    value = static_cast<E>(n);
  })->default_str(std::string(words[static_cast<std::size_t>(value)]));
}
template <class E>
void AddChoice(CLI::App& command, const std::string& name, const std::string& description,
               std::optional<E>& value) {
  const auto words = EnumNames(E{});
  AddWords(command, name, description, {words.begin(), words.end()},
           [&value](std::size_t n) { value = static_cast<E>(n); });
}

RunContext ContextOf(const WorkOptions& options);
// given: what the command reads.
StagedFolder FolderOf(const WorkOptions& options, const std::string& default_out, GivenFiles given);

// The exit code of a result with these faults.
int TellFaults(const std::vector<std::string>& faults);

}  // namespace semblance
