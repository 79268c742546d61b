// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/work_options.h"

#include <fmt/format.h>

#include <cstdio>
#include <utility>

#include "problems/app/exit_code.h"
#include "problems/app/progress.h"
#include "problems/config/terminal_text.h"

namespace semblance::problems {

void AddSet(CLI::App& command, WorkOptions& options) {
  command
      .add_option("--set", options.overrides,
                  "path=value, replaces an option of the configuration; may be repeated")
      ->allow_extra_args(false);
}

void AddOutput(CLI::App& command, WorkOptions& options) {
  command.add_option("--out", options.out, "folder for the results");
  command.add_flag("--force", options.force,
                   "replace files of the same name in a folder that is not empty");
}

void AddThreads(CLI::App& command, int& threads) {
  command.add_option("--threads", threads, "threads to use; the result does not depend on it")
      ->check(WholeNumber())
      ->check(CLI::Range(1, 1024));
}

void AddWork(CLI::App& command, CommandLine& line, WorkOptions& options) {
  options.stop = line.stop;
  AddThreads(command, options.threads);
  command.add_flag("--quiet", options.quiet, "no progress");
}

CLI::Option* AddWords(CLI::App& command, const std::string& name, const std::string& description,
                      const std::vector<std::string>& words,
                      const std::function<void(std::size_t)>& take) {
  const auto take_word = [words, take](const std::string& word) {
    take(static_cast<std::size_t>(std::ranges::find(words, word) - words.begin()));
  };
  return command.add_option_function<std::string>(name, take_word, description)
      ->check(CLI::IsMember(words));
}

RunContext MakeRunContext(const WorkOptions& options) {
  RunContext context;
  context.threads = options.threads;
  context.stop_token = options.stop;
  if (!options.quiet) {
    context.on_event = ProgressPrinter(stderr);
  }
  return context;
}

StagedFolder MakeStagedFolder(const WorkOptions& options, const std::string& default_out,
                              GivenFiles given) {
  return {options.out.empty() ? default_out : options.out,
          options.force ? WhenNotEmpty::kReplaceFiles : WhenNotEmpty::kRefuse, std::move(given)};
}

int PrintFaults(const std::vector<std::string>& faults) {
  for (const std::string& fault : faults) {
    Tell(stderr, "semblance: the result is not usable: {}\n", fault);
  }
  return faults.empty() ? kDone : kNotUsable;
}

}  // namespace semblance::problems
