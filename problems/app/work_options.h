// SPDX-License-Identifier: GPL-3.0-or-later
// Options of most commands: overrides of the configuration, the folder for the results, the number
// of threads, and whether progress is shown.
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

#include "problems/app/commands.h"
#include "problems/io/staged_folder.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

inline int DefaultThreads() {
  return static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

struct WorkOptions {
  std::vector<std::string> overrides;
  std::string out;
  int threads = DefaultThreads();
  bool force = false, quiet = false;
  std::stop_token stop;
};

// Adds --set.
void AddSet(CLI::App& command, WorkOptions& options);
// Adds --out and --force.
void AddOutput(CLI::App& command, WorkOptions& options);
// Adds --threads.
void AddThreads(CLI::App& command, int& threads);
// Adds --threads and --quiet.
void AddWork(CLI::App& command, CommandLine& line, WorkOptions& options);

// Adds an option whose value is one of `words`. Parsing the n-th word calls take(n).
CLI::Option* AddWords(CLI::App& command, const std::string& name, const std::string& description,
                      const std::vector<std::string>& words,
                      const std::function<void(std::size_t)>& take);

// Adds an option whose value is an enum, by its names in configurations (fields.h).
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

RunContext MakeRunContext(const WorkOptions& options);
// given: the files that the command reads and must not replace.
StagedFolder MakeStagedFolder(const WorkOptions& options, const std::string& default_out,
                              GivenFiles given);

// Prints the faults of a result and returns the exit code.
int PrintFaults(const std::vector<std::string>& faults);

}  // namespace semblance::problems
