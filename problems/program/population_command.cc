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
#include "problems/output/given_files.h"
#include "problems/output/output_folder.h"
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
  bool quiet = false, list = false, force = false;
  std::stop_token stop;
};

void TellNotes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) {
    Tell("note: {}\n", note);
  }
}

int PrintPlan(const PopulationPlan& plan) {
  TellNotes(plan.notes);
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

void TellGathered(const std::vector<GatheredFrom>& gathered, const PopulationPlan& plan) {
  for (const GatheredFrom& from : gathered) {
    Tell("from {}: {} taken; it has {} of the {} subjects\n", from.folder.string(), from.taken,
         from.held, plan.entries.size());
  }
}

// Why subjects have no depths. Returns how many were not measured.
int TellFailures(const std::vector<MeasuredSubject>& subjects) {
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

// The plan with the shard's subjects alone.
PopulationPlan PartOf(const PopulationPlan& plan, const Shard& shard) {
  PopulationPlan part = plan;
  part.entries.clear();
  for (std::size_t n = 0; n < plan.entries.size(); ++n) {
    if (static_cast<int>(n % shard.count) == shard.index) {
      part.entries.push_back(plan.entries[n]);
    }
  }
  return part;
}

// Failures are those of all the shard's subjects, also of an earlier call.
int TellPart(const PopulationRunSummary& summary, const PopulationPlan& part,
             const fs::path& root) {
  TellNotes(part.notes);
  const int failures = TellFailures(ReadMeasured(part, root));
  Tell(
      "shard: {} subjects, {} already there, {} done, {} failed; once all shards have run, the "
      "same call without --shard makes the table\n",
      summary.subjects, summary.skipped, summary.done, summary.failed);
  return failures == 0 ? kDone : kNotUsable;
}

// What was made of fewer stays as it was.
int TellNoTable(const std::string& why, const std::vector<std::string>& notes,
                const fs::path& root) {
  TellNotes(notes);
  Tell("no table: {}\nsubjects: {}\n", why, (root / "subjects.csv").string());
  if (fs::exists(root / "table.yaml")) {
    Tell("note: table.yaml and the other results there are of an earlier call\n");
  }
  return kNotUsable;
}

int TellResult(const PopulationResult& result, const fs::path& root) {
  TellNotes(result.notes);
  Tell("{}", PopulationText(result));
  Tell("table: {}\nreport: {}\n", (root / "table.yaml").string(), (root / "report.html").string());
  return result.Count("done") == static_cast<int>(result.subjects.size()) ? kDone : kNotUsable;
}

// What is read, and what may be written.
GivenFiles GivenTo(const PopulationArguments& a, const PopulationPlan& plan) {
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
  RefuseToReplace(root, GivenTo(a, plan));
  if (!a.force) {
    RefuseOtherFolder(plan, root);
  }
  OutputFolder folder(root, WhenNotEmpty::kReplaceFiles);
  TellGathered(GatherSubjects(plan, root, {a.from.begin(), a.from.end()}), plan);
  const PopulationRunSummary summary = MeasureTold(plan, root, a);
  if (const Shard shard = ShardOf(a.shard); shard.count > 1) {
    return TellPart(summary, PartOf(plan, shard), root);
  }
  const fs::path whole = fs::absolute(root).lexically_normal();
  const std::vector<MeasuredSubject> measured = ReadMeasured(plan, root);
  TellFailures(measured);
  if (const std::string why = WhyNoTable(plan, measured); !why.empty()) {
    WriteSubjects(measured, folder);
    return TellNoTable(why, plan.notes, whole);
  }
  const PopulationResult result = AnalysePopulation(plan, measured);
  WritePopulation(result, folder);
  return TellResult(result, whole);
}

void DeclarePopulation(CLI::App& command, CommandLine& line) {
  PopulationArguments& a = *Bind(command, line, &PopulationCommand);
  a.stop = line.stop;
  command
      .add_option("PATH", a.path,
                  "folder with a folder for each subject, or a YAML file (options population)")
      ->required();
  command.add_option("--out", a.out, "folder for what comes of it; a population there goes on");
  command.add_option("--jobs", a.run.jobs, "subjects at a time")->check(CLI::Range(1, 1024));
  command.add_option("--threads", a.threads, "processors to use")->check(CLI::Range(1, 1024));
  command.add_option("--shard", a.shard,
                     "I/N: measures only every N-th subject from the I-th (from 0)");
  command.add_option("--from", a.from, "folders of other shards to take measured subjects from");
  command.add_flag("--list", a.list, "print the subjects and measure nothing");
  command.add_flag("--force", a.force,
                   "replace files of the same name in a folder that holds something else");
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
