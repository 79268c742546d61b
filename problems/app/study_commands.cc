// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "problems/app/exit_code.h"
#include "problems/app/keep_memory.h"
#include "problems/app/live_study.h"
#include "problems/app/shard.h"
#include "problems/app/workbench/http_server.h"
#include "problems/config/terminal_text.h"
#include "problems/io/staged_folder.h"
#include "problems/report/plain_names.h"
#include "problems/study/report/comparison_files.h"
#include "problems/study/report/study_comparison.h"
#include "problems/study/report/study_ranking.h"
#include "problems/study/report/study_report.h"
#include "problems/study/study_run.h"
#include "problems/study/study_submit.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kListedTrials = 20;  // unfinished trials that `study` and `merge` list

// The arguments of all study commands. Each command reads its part.
struct StudyArguments {
  std::vector<std::string> files;
  std::string out, shard;
  std::string rerun, metric, better;
  bool force = false;
  std::string pairs = "all";
  bool quiet = false, list = false, slurm = false, ranks = false, missing = false, serve = false;
  int port = 0;
  StudyRunOptions run;
  SubmitOptions submit;
  std::stop_token stop;
};

int PrintPlan(const StudyPlan& plan, const std::string& only) {
  const std::vector<bool> chosen = SelectTrials(plan, only);
  for (std::size_t n = 0; n < plan.trials.size(); ++n) {
    const StudyTrial& trial = plan.trials[n];
    if (chosen[n]) {
      Tell("{} {} | {}\n", trial.id, trial.subject, fmt::join(trial.values, " | "));
    }
  }
  Tell("plan {}: {} trials over {}\n", plan.hash, plan.trials.size(), fmt::join(plan.axes, ", "));
  if (!only.empty()) {
    Tell("of these, {} fulfil: {}\n", std::ranges::count(chosen, true), only);
  }
  return kDone;
}

void PrintVersions(const StudyResults& results) {
  for (const std::string& note : VersionNotes(results)) {
    Tell("note: {}\n", note);
  }
}

int FindExitCode(const StudyResults& results) {
  const int done = results.Count("done");
  return (results.HasMetric() || done == 0) && done == static_cast<int>(results.trials.size())
             ? kDone
             : kNotUsable;
}

void PrintCounts(const StudyResults& results) {
  const int damaged = results.Count("damaged");
  Tell("{} of {} trials done, {} unusable, {} failed, {} missing{}\n", results.Count("done"),
       results.trials.size(), results.Count("unusable"), results.Count("failed"),
       results.Count("missing"),
       damaged > 0 ? fmt::format(", {} damaged; run the study again", damaged) : "");
}

// Lists the trials without numbers, one per line, and counts those beyond `most`.
void PrintUnfinished(const StudyResults& results, std::size_t most, const fs::path& root) {
  std::size_t count = 0;
  for (const TrialRow& row : results.trials) {
    if (row.status == "failed" || row.status == "missing" || row.status == "damaged") {
      ++count;
      if (count <= most) {
        Tell("{}: {} {} | {}{}{}\n", row.status, row.id, row.subject, fmt::join(row.values, " | "),
             row.reason.empty() ? "" : ": ", row.reason);
      }
    }
  }
  if (count > most) {
    Tell("{} no numbers; semblance status {} --missing lists all\n",
         Counted(static_cast<long long>(count), "trial has", "trials have"), root.string());
  }
}

// Prints the state of a study's folder, and how to continue. The summary comes first; `most` is the
// number of unfinished trials to list.
int PrintStudyState(const StudyResults& results, const fs::path& root, std::size_t most) {
  PrintCounts(results);
  Tell("{}", RankingText(results));
  if (const std::string unusable = UnusableText(results); !unusable.empty()) {
    Tell("{}\n", unusable);
  }
  PrintVersions(results);
  PrintUnfinished(results, most, root);
  if (fs::exists(root / "report.html")) {
    Tell("report: {}\n", fs::absolute(root / "report.html").lexically_normal().string());
  } else {
    Tell("no report yet; semblance merge {} makes one of the finished trials\n", root.string());
  }
  return FindExitCode(results);
}

// Prints the state of the trials that --only selected; the others may be missing.
int PrintPartState(const StudyResults& results, const std::vector<bool>& selected,
                   const fs::path& root) {
  int count = 0, done = 0;
  for (std::size_t n = 0; n < results.trials.size(); ++n) {
    const TrialRow& row = results.trials[n];
    count += selected[n] ? 1 : 0;
    done += selected[n] && row.status == "done" ? 1 : 0;
    if (selected[n] && row.status != "done") {
      Tell("{}: {} {} | {}: {}\n", row.status, row.id, row.subject, fmt::join(row.values, " | "),
           row.reason);
    }
  }
  PrintVersions(results);
  Tell("{} of the {} selected trials done; {} of all {} trials of the study are missing\n", done,
       count, results.Count("missing"), results.trials.size());
  Tell("report: {}\n", fs::absolute(root / "report.html").lexically_normal().string());
  if (const std::string without = MissingMetricText(results); !without.empty()) {
    Tell("{}\n", without);
  }
  return (results.HasMetric() || results.Count("done") == 0) && done == count ? kDone : kNotUsable;
}

// Shows a study in the browser as long as it lives.
class StudyServer {
 public:
  StudyServer(LiveStudy& live, int port)
      : server_([&live](const PageRequest& request) { return live.Answer(request); },
                {.port = port, .token = {}, .limits = {}}),
        serving_([this](const std::stop_token& stop) { server_.Serve(stop); }) {
    Tell("open in a browser on this machine: {}\n", server_.Url());
    std::fflush(stdout);
  }

 private:
  HttpServer server_;
  std::jthread serving_;
};

// Runs a study and shows its progress on the terminal, unless --quiet, and on the live page.
StudySummary RunWithProgress(const StudyPlan& plan, const fs::path& root, StudyRunOptions options,
                             const StudyArguments& a, LiveStudy& live) {
  StudyProgress progress(stderr);
  options.on_progress = [&](const StudyEta& eta, const std::string& trial) {
    live.Update(eta, trial);
    if (!a.quiet) {
      progress(eta, trial);
    }
  };
  RunContext context;
  context.stop_token = a.stop;
  return RunStudy(plan, root, options, context);
}

void PrintChange(const StudySummary& summary, const fs::path& root) {
  for (const std::string& line : summary.damaged) {
    Tell("note: damaged, so the trial ran again: {}\n", line);
  }
  if (summary.changed) {
    Tell(
        "note: the study has changed since {} was written: {} of the {} trials exist already; {} "
        "trials of the earlier plan are no longer in it, and stay in trials/\n",
        root.string(), summary.skipped, summary.trials, summary.left_over);
  }
}

StudyRunOptions MakeRunOptions(const StudyArguments& a) {
  StudyRunOptions options = a.run;
  const Shard shard = ParseShard(a.shard);
  options.shard = shard.index;
  options.shards = shard.count;
  options.rerun = ParseRerun(a.rerun);
  return options;
}

// A shard writes no tables and no report; the merge does.
void PrintShard(const StudySummary& summary, const StudyRunOptions& options) {
  Tell(
      "shard {} of {}: {} trials, {} existed, {} done, {} failed; collect them with semblance "
      "merge\n",
      options.shard, options.shards, summary.trials, summary.skipped, summary.done, summary.failed);
}

// Gives an open page the time to take the last report.
void EndLivePage(LiveStudy& live) {
  live.End();
  live.WaitForPage(std::chrono::seconds(5));
}

int StudyCommand(const StudyArguments& a) {
  KeepFreedMemory();
  const bool plan_only = a.list || (a.files.size() == 2 && a.files[0] == "plan");
  if (a.files.size() == 2 && !plan_only) {
    throw InputError(
        fmt::format("study {} {}: one study at a time; only the word 'plan' may stand before "
                    "the file",
                    a.files[0], a.files[1]));
  }
  const fs::path file = a.files.back();
  const StudyRunOptions options = MakeRunOptions(a);
  const StudyPlan plan = ReadStudy(file);
  for (const std::string& note : plan.notes) {
    Tell("note: {}\n", note);
  }
  if (plan_only) {
    return PrintPlan(plan, options.only);
  }
  const fs::path root = a.out.empty() ? "out/" + file.stem().string() : a.out;
  LiveStudy live(plan.title, root);
  std::optional<StudyServer> server;
  if (a.serve) {
    server.emplace(live, a.port);
  }
  const StudySummary summary = RunWithProgress(plan, root, options, a, live);
  PrintChange(summary, root);
  if (options.shards > 1) {
    PrintShard(summary, options);
    EndLivePage(live);
    return kDone;
  }
  OutputFolder folder(root, WhenNotEmpty::kReplaceFiles);
  const StudyResults results = WriteStudyTables(folder);
  EndLivePage(live);
  return options.only.empty() ? PrintStudyState(results, root, kListedTrials)
                              : PrintPartState(results, SelectTrials(plan, options.only), root);
}

int MergeCommand(const StudyArguments& a) {
  const fs::path root = a.files.at(0);
  for (const std::string& line : GatherTrials(root, {a.files.begin() + 1, a.files.end()})) {
    Tell(stderr, "semblance: {}\n", line);
  }
  if (!fs::exists(root / "plan.json")) {
    throw IoError(fmt::format("{}: not the folder of a study; it has no plan.json", root.string()));
  }
  OutputFolder folder(root, WhenNotEmpty::kReplaceFiles);
  const StudyResults results = WriteStudyTables(folder);
  return a.quiet ? FindExitCode(results) : PrintStudyState(results, root, kListedTrials);
}

int StatusCommand(const StudyArguments& a) {
  const fs::path root = a.files.at(0);
  constexpr auto kAll = std::numeric_limits<std::size_t>::max();
  return PrintStudyState(ReadStudyResults(root), root, a.missing ? kAll : 0);
}

int CompareCommand(const StudyArguments& a) {
  CompareOptions options{
      .metric = a.metric,
      .better = std::nullopt,
      .pairs = a.pairs == "matched" ? ComparedPairs::kMatched : ComparedPairs::kAll};
  if (!a.better.empty()) {
    options.better = a.better == "higher"    ? Better::kHigher
                     : a.better == "nearest" ? Better::kNearest
                                             : Better::kLower;
  }
  const std::vector<NamedStudy> studies = ReadStudies({a.files.begin(), a.files.end()}, a.metric);
  if (a.ranks) {
    if (studies.size() < 2) {
      throw InputError("--ranks compares the order of treatments in two studies; give two folders");
    }
    for (std::size_t k = 1; k < studies.size(); ++k) {
      Tell("{}", RankText(CompareRanks(studies.front(), studies[k], options)));
    }
    return kDone;
  }
  const StudyComparison comparison = CompareStudies(studies, options);
  Tell("{}", ComparisonText(comparison));
  if (!a.out.empty()) {
    StagedFolder folder(a.out, a.force ? WhenNotEmpty::kReplaceFiles : WhenNotEmpty::kRefuse);
    WriteComparison(comparison, folder.Files());
    folder.Publish();
    Tell("report: {}\n", (folder.Root() / "report.html").string());
  }
  return kDone;
}

int SubmitCommand(const StudyArguments& a) {
  SubmitOptions options = a.submit;
  options.program = fs::read_symlink("/proc/self/exe");
  options.study = a.files.at(0);
  options.folder = a.out.empty() ? "out/" + options.study.stem().string() : a.out;
  ReadStudy(options.study);  // reports its faults here rather than on every node
  fmt::print("{}", SubmitScript(options));
  std::fflush(stdout);
  SubmitStudy(options);
  return kDone;
}

void DeclareStudy(CLI::App& study, CommandLine& line) {
  StudyArguments& a = *Bind(study, line, &StudyCommand);
  a.stop = line.stop;
  study.add_option("CONFIG", a.files, "YAML file of the study; `plan` before it means --list")
      ->required()
      ->expected(1, 2);
  study.add_option("--out", a.out, "folder for the trials; a study in it continues");
  study.add_option("--jobs", a.run.jobs, "trials at a time")->check(CLI::Range(1, 1024));
  study.add_option("--shard", a.shard,
                   "I/N: only every N-th trial, starting with trial I (from 0)");
  study.add_option("--cache", a.run.cache,
                   "folder of implicit faces, to share them with other calls");
  study
      .add_option("--cache-limit-mb", a.run.cache_limit_mb,
                  "size above which the oldest files of the cache are deleted")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  study.add_flag("--list", a.list, "print the plan and run nothing");
  study.add_option(
      "--only", a.run.only,
      "condition for the trials to run, over subject, tag and axes, e.g. \"subject = a "
      "and rounds >= 2\"; = != < <= > >=, ~ with * and ?, and, or, not, ( )");
  study
      .add_option("--rerun", a.rerun,
                  "run finished trials again: failed; unusable (and failed); other-versions, those "
                  "that another version or build of the program made; all")
      ->check(CLI::IsMember({"failed", "unusable", "other-versions", "all"}));
  study.add_flag("--quiet", a.quiet, "do not show progress");
  CLI::Option* const serve = study.add_flag(
      "--serve", a.serve, "show a live page in a browser on this machine while the study runs");
  study.add_option("--port", a.port, "port of 127.0.0.1 for --serve [any free one]")
      ->check(CLI::Range(0, 65535))
      ->needs(serve);
}

void DeclareSubmit(CLI::App& submit, CommandLine& line) {
  StudyArguments& a = *Bind(submit, line, &SubmitCommand);
  submit.add_option("CONFIG", a.files, "YAML file of the study")->required()->expected(1);
  submit.add_flag("--slurm", a.slurm, "the scheduler of the cluster; no other is supported")
      ->required();
  submit.add_option("--out", a.out, "folder for the trials, which every node must see");
  submit
      .add_option("--shards", a.submit.shards,
                  "number of elements of the array; each should have 30 s of work or more")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  submit.add_option("--jobs", a.submit.jobs, "trials at a time in each element")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  submit
      .add_option("--sbatch", a.submit.sbatch,
                  "an option for sbatch, e.g. --sbatch=--partition=long; may be repeated")
      ->allow_extra_args(false);
}

void DeclareMerge(CLI::App& merge, CommandLine& line) {
  StudyArguments& a = *Bind(merge, line, &MergeCommand);
  merge.add_option("DIR", a.files, "folder of the study, then folders to take trials from")
      ->required();
  merge.add_flag("--quiet", a.quiet, "do not print the state of the study");
}

void DeclareStatus(CLI::App& status, CommandLine& line) {
  StudyArguments& a = *Bind(status, line, &StatusCommand);
  status.add_option("DIR", a.files, "folder of the study")->required()->expected(1);
  status.add_flag("--missing", a.missing,
                  "list the trials that are missing, failed or damaged, each with its reason");
}

void DeclareCompare(CLI::App& compare, CommandLine& line) {
  StudyArguments& a = *Bind(compare, line, &CompareCommand);
  compare
      .add_option("DIR", a.files, "folders of one study or more, over the subjects that all have")
      ->required()
      ->expected(1, 100);
  compare.add_option("--metric", a.metric,
                     "number of result.json by its path; default: the metric of the first study");
  compare
      .add_option("--better", a.better,
                  "which values of the metric are better; default by its name: higher for shares "
                  "within a distance, nearest to 0 for signed errors, nearest to the stated share "
                  "for coverage, lower for all others")
      ->check(CLI::IsMember({"lower", "higher", "nearest"}));
  compare
      .add_option(
          "--pairs", a.pairs,
          "all: every two treatments; matched: each treatment of a later study with the one "
          "of the same name in the first study, else with the best of the first")
      ->check(CLI::IsMember({"all", "matched"}))
      ->capture_default_str();
  CLI::Option* const out =
      compare.add_option("--out", a.out, "folder for pairs.csv, values.csv and report.html");
  compare
      .add_flag("--ranks", a.ranks,
                "print instead how similarly the studies rank the treatments that they share, each "
                "over its own subjects, which may differ")
      ->excludes(out);
  compare.add_flag("--force", a.force,
                   "replace files of the same name in a folder that is not empty");
}

}  // namespace

std::span<const ProgramCommand> StudyCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"study", "run every trial of a study that is not done yet", &DeclareStudy},
      ProgramCommand{"submit", "run a study on a cluster: an array of shards, then the merge",
                     &DeclareSubmit},
      ProgramCommand{"merge", "make the tables and the report of a study from its shards",
                     &DeclareMerge},
      ProgramCommand{"compare", "compare treatments in pairs, over the subjects they share",
                     &DeclareCompare},
      ProgramCommand{"status", "show the progress of a study", &DeclareStatus},
  };
  return kCommands;
}

}  // namespace semblance::problems
