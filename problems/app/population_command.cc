// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "problems/app/exit_code.h"
#include "problems/app/shard.h"
#include "problems/app/work_options.h"
#include "problems/config/terminal_text.h"
#include "problems/io/given_files.h"
#include "problems/io/output_folder.h"
#include "problems/population/population_result.h"
#include "problems/population/population_run.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// The arguments of the command.
struct PopulationArguments {
  std::string path, out, shard;
  std::vector<std::string> from;
  PopulationRunOptions run;
  int threads = DefaultThreads();
  bool quiet = false, list = false, force = false;
  std::stop_token stop;
};

void PrintNoteLines(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) {
    Tell("note: {}\n", note);
  }
}

int PrintPlan(const PopulationPlan& plan) {
  PrintNoteLines(plan.notes);
  for (const PopulationEntry& entry : plan.entries) {
    Tell("{} {}\n", entry.id, entry.subject.name);
  }
  Tell("{} subjects\n", plan.entries.size());
  return kDone;
}

PopulationRunSummary MeasureWithProgress(const PopulationPlan& plan, const fs::path& root,
                                         const PopulationArguments& a) {
  PopulationRunOptions options = a.run;
  const Shard shard = ParseShard(a.shard);
  options.shard = shard.index;
  options.shards = shard.count;
  if (!a.quiet) {
    options.on_progress = [](int done, int of, const std::string& name, const std::string& status) {
      Tell(stderr, "{}/{} {}: {}\n", done, of, name, status);
    };
  }
  const RunContext context{.on_event = {},
                           .stop_token = a.stop,
                           .threads = std::max(1, a.threads / std::max(1, options.jobs))};
  return MeasurePopulation(plan, root, options, context);
}

void PrintGathered(const std::vector<GatheredFrom>& gathered, const PopulationPlan& plan) {
  for (const GatheredFrom& from : gathered) {
    Tell("from {}: {} taken; it has {} of the {} subjects\n", from.folder.string(), from.taken,
         from.held, plan.entries.size());
  }
}

// Prints why subjects have no depths, and returns their number.
int PrintFailures(const std::vector<MeasuredSubject>& subjects) {
  int failures = 0;
  for (const MeasuredSubject& subject : subjects) {
    if (subject.status != "done") {
      Tell("{}: {}{}{}\n", subject.status, subject.person.name, subject.reason.empty() ? "" : ": ",
           subject.reason);
      ++failures;
    }
  }
  return failures;
}

// The plan with only the subjects of the shard.
PopulationPlan SelectShard(const PopulationPlan& plan, const Shard& shard) {
  PopulationPlan part = plan;
  part.entries.clear();
  for (std::size_t n = 0; n < plan.entries.size(); ++n) {
    if (static_cast<int>(n % shard.count) == shard.index) {
      part.entries.push_back(plan.entries[n]);
    }
  }
  return part;
}

// Prints the state of a shard. Failures of earlier calls are printed too.
int PrintShardState(const PopulationRunSummary& summary, const PopulationPlan& part,
                    const fs::path& root) {
  PrintNoteLines(part.notes);
  const int failures = PrintFailures(ReadMeasured(part, root));
  Tell(
      "shard: {} subjects, {} measured before, {} done, {} failed; when all shards have run, the "
      "same call without --shard makes the table\n",
      summary.subjects, summary.skipped, summary.done, summary.failed);
  return failures == 0 ? kDone : kNotUsable;
}

// Prints why there is no table. Results of an earlier call stay in the folder.
int PrintNoTable(const std::string& why, const std::vector<std::string>& notes,
                 const fs::path& root) {
  PrintNoteLines(notes);
  Tell("no table: {}\nsubjects: {}\n", why, (root / "subjects.csv").string());
  if (fs::exists(root / "table.yaml")) {
    Tell("note: table.yaml and the other results in the folder belong to an earlier call\n");
  }
  return kNotUsable;
}

int PrintResult(const PopulationResult& result, const fs::path& root) {
  PrintNoteLines(result.notes);
  Tell("{}", PopulationText(result));
  Tell("table: {}\nreport: {}\n", (root / "table.yaml").string(), (root / "report.html").string());
  return result.Count("done") == static_cast<int>(result.subjects.size()) ? kDone : kNotUsable;
}

// The files that are read, and those that may be written.
GivenFiles ListFiles(const PopulationArguments& a, const PopulationPlan& plan) {
  GivenFiles given{.files = {a.path}, .outputs = kPopulationFiles};
  if (fs::is_directory(a.path)) {
    given.files.push_back(fs::path(a.path) / "subjects.csv");
  }
  for (const NamedFile& named : NamedFiles(plan.file)) {
    given.files.push_back(named.file);
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
  RefuseToReplace(root, ListFiles(a, plan));
  if (!a.force) {
    RefuseOtherFolder(plan, root);
  }
  NewFolders made(root);
  OutputFolder folder(root, WhenNotEmpty::kReplaceFiles);
  PrintGathered(GatherSubjects(plan, root, {a.from.begin(), a.from.end()}), plan);
  made.Keep();
  const PopulationRunSummary summary = MeasureWithProgress(plan, root, a);
  if (const Shard shard = ParseShard(a.shard); shard.count > 1) {
    return PrintShardState(summary, SelectShard(plan, shard), root);
  }
  const fs::path whole = fs::absolute(root).lexically_normal();
  const std::vector<MeasuredSubject> measured = ReadMeasured(plan, root);
  PrintFailures(measured);
  if (const std::string why = WhyNoTable(plan, measured); !why.empty()) {
    WriteSubjects(measured, folder);
    return PrintNoTable(why, plan.notes, whole);
  }
  const PopulationResult result = AnalysePopulation(plan, measured);
  WritePopulation(result, folder);
  return PrintResult(result, whole);
}

void DeclarePopulation(CLI::App& command, CommandLine& line) {
  PopulationArguments& a = *Bind(command, line, &PopulationCommand);
  a.stop = line.stop;
  command
      .add_option("PATH", a.path,
                  "folder with a folder for each subject, or a YAML file (options population)")
      ->required();
  command.add_option("--out", a.out, "folder for the results; a population in it is continued");
  command.add_option("--jobs", a.run.jobs, "subjects at a time")->check(CLI::Range(1, 1024));
  AddThreads(command, a.threads);
  command.add_option("--shard", a.shard,
                     "I/N: measure only every N-th subject, beginning with the I-th (from 0)");
  command.add_option("--from", a.from,
                     "folders of other shards whose measured subjects are copied");
  command.add_flag("--list", a.list, "print the subjects and measure nothing");
  command.add_flag("--force", a.force,
                   "replace files of the same name in a folder with other contents");
  command.add_flag("--rerun-failed", a.run.rerun_failed, "measure failed subjects again");
  command.add_flag("--quiet", a.quiet, "no progress");
}

}  // namespace

std::span<const ProgramCommand> PopulationCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{
          "population",
          "make a tissue table with correlations, and modes of depth, from many subjects",
          &DeclarePopulation},
  };
  return kCommands;
}

}  // namespace semblance::problems
