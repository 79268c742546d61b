// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/population_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "problems/command_line/exit_code.h"
#include "problems/command_line/shard.h"
#include "problems/config/terminal_text.h"
#include "problems/output/files.h"
#include "problems/output/given_files.h"
#include "problems/population/population_files.h"
#include "problems/population/population_result.h"
#include "problems/population/population_run.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

// What the user typed.
struct PopulationArguments {
  std::string path, out, shard;
  std::vector<std::string> from;
  PopulationRunOptions run;
  int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool quiet = false, list = false;
  std::stop_token stop;
};

int PrintPlan(const PopulationPlan& plan) {
  for (const PopulationEntry& entry : plan.entries) {
    Tell("{} {}\n", entry.id, entry.subject.name);
  }
  Tell("{} subjects\n", plan.entries.size());
  return kDone;
}

PopulationRunSummary MeasureTold(const PopulationPlan& plan, const fs::path& root,
                                 const PopulationArguments& a) {
  PopulationRunOptions options = a.run;
  const Shard shard = ShardOf(a.shard);
  options.shard = shard.index;
  options.shards = shard.count;
  if (!a.quiet) {
    options.on_progress = [](int done, int of, const std::string& name, const std::string& status) {
      fmt::print(stderr, "{}", ForTerminal(fmt::format("{}/{} {}: {}\n", done, of, name, status)));
    };
  }
  const RunContext context{.on_event = {},
                           .stop_token = a.stop,
                           .threads = std::max(1, a.threads / std::max(1, options.jobs))};
  return MeasurePopulation(plan, root, options, context);
}

int TellResult(const PopulationResult& result, const fs::path& root) {
  for (const MeasuredSubject& subject : result.subjects) {
    if (subject.status != "done") {
      Tell("{}: {}{}{}\n", subject.status, subject.person.name, subject.reason.empty() ? "" : ": ",
           subject.reason);
    }
  }
  for (const std::string& note : result.notes) {
    Tell("note: {}\n", note);
  }
  Tell("{}", PopulationText(result));
  Tell("table: {}\nreport: {}\n", (root / "table.yaml").string(), (root / "report.html").string());
  return result.Count("done") == static_cast<int>(result.subjects.size()) ? kDone : kNotUsable;
}

// What is read, and what may be written.
GivenFiles GivenTo(const PopulationArguments& a, const PopulationPlan& plan) {
  GivenFiles given{.files = {a.path}, .outputs = kPopulationFiles};
  for (const PopulationEntry& entry : plan.entries) {
    for (const NamedFile& named : NamedFiles(entry.subject)) {
      given.files.push_back(named.file);
    }
  }
  return given;
}

int PopulationCommand(const PopulationArguments& a) {
  const PopulationPlan plan = ReadPopulation(a.path);
  if (a.list) {
    return PrintPlan(plan);
  }
  const std::string name = PlainName(a.path);
  const fs::path root = a.out.empty() ? fs::path("out") / name : fs::path(a.out);
  RefuseToReplace(root, GivenTo(a, plan));
  OutputFolder folder(root, WhenNotEmpty::kReplaceFiles);
  GatherSubjects(plan, root, {a.from.begin(), a.from.end()});
  const PopulationRunSummary summary = MeasureTold(plan, root, a);
  if (ShardOf(a.shard).count > 1) {
    Tell(
        "shard: {} subjects, {} already there, {} done, {} failed; once all shards have run, the "
        "same call without --shard makes the table\n",
        summary.subjects, summary.skipped, summary.done, summary.failed);
    return kDone;
  }
  const PopulationResult result = AnalysePopulation(plan, ReadMeasured(plan, root));
  WritePopulation(result, folder);
  return TellResult(result, fs::absolute(root).lexically_normal());
}

void DeclarePopulation(CLI::App& command, CommandLine& line) {
  PopulationArguments& a = *Bind(command, line, &PopulationCommand);
  a.stop = line.stop;
  command
      .add_option("PATH", a.path,
                  "folder with a folder for each subject, or a YAML file (options population)")
      ->required();
  command.add_option("--out", a.out, "folder for what comes of it; what is measured there stays");
  command.add_option("--jobs", a.run.jobs, "subjects at a time")->check(CLI::Range(1, 1024));
  command.add_option("--threads", a.threads, "processors to use")->check(CLI::Range(1, 1024));
  command.add_option("--shard", a.shard,
                     "I/N: measures only every N-th subject from the I-th (from 0)");
  command.add_option("--from", a.from, "folders of other shards to take measured subjects from");
  command.add_flag("--list", a.list, "print the subjects and measure nothing");
  command.add_flag("--rerun-failed", a.run.rerun_failed, "measure again what failed");
  command.add_flag("--quiet", a.quiet, "no progress");
}

}  // namespace

std::span<const ProgramCommand> PopulationCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"population",
                     "make a tissue table with correlations, and modes of depth, of many subjects",
                     &DeclarePopulation},
  };
  return kCommands;
}

}  // namespace semblance
