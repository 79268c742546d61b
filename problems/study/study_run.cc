// SPDX-License-Identifier: GPL-3.0-or-later
//
// The queue of a study
// --------------------
// A study's folder is the only state that lasts. Every call of RunStudy rebuilds the queue from the
// plan and from the trials that are on disk, so that a call after `kill -9` needs no recovery.
// The life of one trial within one call:
//
//                for each trial of this shard that --only selects
//                                    |
//                                    v
//            is trials/<id>/ sound: the hashes of trial.json and of its files?  (ReadTrial)
//                      | no                      | yes
//                      |                         v
//                      |      does --rerun ask for its status or its version, or
//                      |      does it lack a file that `keep` requests now?
//                      |         | yes                   | no
//                      v         v                       v
//                    +-------------+               +-----------+
//                    |   QUEUED    |               |  SKIPPED  |  trial.json gets the axes of this
//                    +-------------+               +-----------+  plan if they have changed
//                           |  a thread claims it: next_++
//                           v
//                    +-------------+  stop request, kill -9
//                    |   RUNNING   |-----------------------> the disk is as it was before
//                    +-------------+
//                           |  result, faults of the result, or an exception
//                           v
//                    +-------------+  kill -9, disk full
//                    |   WRITING   |-----------------------> trial.json is missing, or still the
//                    +-------------+                         earlier one; the next call decides
//                           |  rename of trial.json
//                           v
//                 DONE, UNUSABLE or FAILED  (its `status`)
//
// Invariants:
//
//   (1)  A trial exists if and only if its trial.json holds its id and its own hash, and its other
//        files have the hashes that trial.json lists. A trial that was damaged later does not
//        exist: it runs again.
//   (2)  Every file is written under a temporary name and renamed. trial.json is written last. So
//        a trial that exists has all its files. During a rerun the earlier trial.json stays until
//        the rename; a merge notices files that differ from it by their hashes.
//   (3)  Unless `keep` is summary, trial.json and the results before it are synced, so that (2)
//        holds after a power failure too. With `keep: summary` there are no other results: if
//        trial.json is lost or empty, (1) makes the trial run again.
//   (4)  The id of a trial is a hash of its job, its resolved experiment, the content of its
//        input files, and the sources of the caller's scheme and metrics. A trial on disk is
//        therefore valid for every plan that contains its id: a changed study keeps the trials that
//        it still has, and no trial becomes invalid. The contents are hashed when the study is read
//        and compared again after each trial, because a file may change during the work. The
//        program is not part of the id: trials of another version stay, the tables name them, and
//        --rerun other-versions makes them again.
//   (5)  trial.json holds no time, host, folder or number of threads. Its bytes depend only on
//        the trial, on the axes and `keep` of the plan, and on the program and the versions of
//        its libraries. Everything else is in timing.json and in traceback.txt of a caller's
//        function that failed. trial.json lists neither.
//   (6)  Shard i of n owns the trials k with k % n == i. Shards share no trial, hold no lock, and
//        never read each other's trials. If two processes nevertheless run the same trial, both
//        write the same bytes (5) by renames (2), and either order is right.
//   (7)  Within a process a trial is claimed once, because next_ is atomic and queue_ is constant
//        while threads run. A trial runs on one thread, so its result does not depend on `jobs`.
//   (8)  While threads run, mutex_ guards summary_, broken_, ended_ and the calls of on_progress.
//   (9)  An exception inside a trial is the result of that trial (FAILED, with the reason). A
//        fault in writing the folder ends the whole queue (broken_), because no other trial could
//        be written.
//  (10)  plan.json is written before the first trial runs. It lists the trials for tables and
//        merges. The queue reads it only to refuse the folder of another study and to count the
//        trials that are left over.
#include "problems/study/study_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <ctime>
#include <map>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <system_error>
#include <thread>

#include "problems/experiment/experiment_config.h"
#include "problems/experiment/input_contents.h"
#include "problems/experiment/input_files.h"
#include "problems/report/result_json.h"
#include "problems/report/run_folder.h"
#include "problems/report/scene_json.h"
#include "problems/study/depth_study.h"
#include "problems/study/identify_study.h"
#include "problems/study/study_metrics.h"
#include "problems/study/study_tables.h"
#include "problems/study/trial_folder.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The traceback of a caller's function that failed.
constexpr const char* kTraceback = "traceback.txt";

// The first members of trial.json.
Json TrialHead(const StudyPlan& plan, const StudyTrial& trial) {
  Json json = {{"id", trial.id}, {"subject", trial.subject}, {"axes", Json::object()}};
  for (std::size_t k = 0; k < plan.axes.size(); ++k) {
    json["axes"][plan.axes[k]] = trial.values[k];
  }
  return json;
}

// Adds inputs and configuration. Inputs have their name and hash but no folder, because folders
// differ between machines.
void AppendProvenance(const StudyTrial& trial, FileHashes& hashes, Json& json) {
  json["inputs"] = Json::array();
  for (const NamedFile& input : NamedInputs(trial.experiment)) {
    for (const fs::path& part : ListParts(input)) {
      json["inputs"].push_back({{"option", input.option},
                                {"file", part.filename().string()},
                                {"sha256", hashes.Of(part)}});
    }
  }
  json["config"] =
      ToYaml(WithInputs(MakeConfigTree(trial.experiment), NamedFiles(trial.experiment),
                        [](const NamedFile& input) { return input.file.filename().string(); }));
}

// The id of a trial has the contents that its inputs had when the study was read. A result of other
// contents must not get it. Throws IoError if an input has changed since then.
void RequireSameInputs(const Experiment& experiment, const InputContents& contents) {
  for (const NamedFile& input : NamedFiles(experiment)) {
    const auto known = contents.by_input.find({input.option, input.file});
    if (known != contents.by_input.end() && HashContent(input, *contents.hashes) != known->second) {
      throw IoError(fmt::format(
          "{}: {} has changed since the study began; run the study again, which then makes the "
          "trials of the changed file",
          input.option, input.file.string()));
    }
  }
}

std::shared_ptr<const DiskCache> OpenDiskCache(const StudyRunOptions& options) {
  constexpr std::uintmax_t kMegabyte = 1'000'000;
  return options.cache.empty()
             ? nullptr
             : std::make_shared<const DiskCache>(options.cache, kMegabyte * options.cache_limit_mb);
}

class StudyRunner {
 public:
  StudyRunner(const StudyPlan& plan, fs::path folder, const StudyRunOptions& options,
              const RunContext& context)
      : plan_(plan),
        folder_(std::move(folder)),
        options_(options),
        context_(context),
        // A trial uses up to 8 stages, and trials share most of them. A larger capacity takes more
        // memory; a smaller one makes stages again when trials of several subjects alternate.
        cache_(4 * options.jobs + 6, OpenDiskCache(options)) {}

  // Runs the queue of this shard.
  void Run() {
    const std::vector<bool> is_selected = SelectTrials(plan_, options_.only);
    std::vector<const StudyTrial*> chosen;
    for (std::size_t n = 0; n < plan_.trials.size(); ++n) {
      if (static_cast<int>(n % options_.shards) == options_.shard && is_selected[n]) {
        chosen.push_back(&plan_.trials[n]);
      }
    }
    const std::vector<StoredTrial> stored = ReadStored(chosen);
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      Queue(*chosen[n], stored[n]);
    }
    std::vector<std::jthread> threads;
    try {
      for (int job = 0; job < std::min<int>(options_.jobs, static_cast<int>(queue_.size()));
           ++job) {
        threads.emplace_back([this] {
          Work();
          const std::lock_guard lock(mutex_);
          ++ended_;
          thread_ended_.notify_one();
        });
      }
    } catch (const std::system_error&) {
      if (threads.empty()) {
        throw;
      }  // otherwise the threads that did start do all the work
    }
    WatchUntilEnded(threads.size());
    threads.clear();  // joins
    if (broken_) {
      std::rethrow_exception(broken_);
    }
    context_.ThrowIfStopped();
    summary_.shared_made = cache_.made();
  }
  const StudySummary& summary() const { return summary_; }

 private:
  // Reads the chosen trials that are on disk. With `keep: run` their files hold many bytes, of
  // which the hashes are compared by several threads.
  std::vector<StoredTrial> ReadStored(const std::vector<const StudyTrial*>& chosen) const {
    std::vector<StoredTrial> stored(chosen.size());
    SharedNames none([](std::string_view) { return false; });
    ParallelFor(chosen.size(), static_cast<int>(std::max(1U, std::thread::hardware_concurrency())),
                1, [&](std::size_t n) {
                  stored[n] = ReadTrial(folder_, chosen[n]->id, TrialCheck::kAll, none);
                });
    return stored;
  }

  void Queue(const StudyTrial& trial, const StoredTrial& stored) {
    ++summary_.trials;
    if (!stored.fault.empty()) {
      summary_.damaged.push_back(fmt::format("trials/{}: {}", trial.id, stored.fault));
    }
    if (stored.numbers && !MustRerun(*stored.numbers) &&
        HasKeptFiles(trial, stored.numbers->status)) {
      if (!HasAxes(trial, *stored.numbers)) {
        UpdateAxes(trial);
      }
      ++summary_.skipped;
    } else {
      queue_.push_back(&trial);
    }
  }

  bool MustRerun(const TrialNumbers& trial) const {
    return options_.rerun == Rerun::kAll ||
           (options_.rerun == Rerun::kOtherVersions && !IsOfThisProgram(trial)) ||
           (trial.status == "failed" &&
            (options_.rerun == Rerun::kFailed || options_.rerun == Rerun::kUnusable)) ||
           (trial.status == "unusable" && options_.rerun == Rerun::kUnusable);
  }

  // Returns true if the trial's folder has the files that `keep` requests now. `keep` may have
  // asked for fewer files when the trial ran.
  bool HasKeptFiles(const StudyTrial& trial, const std::string& status) const {
    const bool is_depth = plan_.job == StudyJob::kDepth;
    const bool has_none = status == "failed" || (plan_.keep == TrialFiles::kView && is_depth &&
                                                 trial.subject != plan_.trials.front().subject);
    const char* file = plan_.keep == TrialFiles::kRun    ? "result.json"
                       : plan_.keep == TrialFiles::kView ? (is_depth ? "depth.png" : "scene.json")
                                                         : "trial.json";
    return has_none || fs::exists(TrialFolder(folder_, trial.id) / file);
  }

  // Returns true if the trial on disk has the subject and the axes of this plan.
  bool HasAxes(const StudyTrial& trial, const TrialNumbers& stored) const {
    std::vector<std::pair<std::string, std::string>> axes;
    for (std::size_t k = 0; k < plan_.axes.size(); ++k) {
      axes.emplace_back(plan_.axes[k], trial.values[k]);
    }
    return stored.subject == trial.subject && stored.axes == axes;
  }

  // Replaces the axes of an earlier plan in trial.json by those of this plan.
  void UpdateAxes(const StudyTrial& trial) const {
    Json stored = *ReadTrialFile(folder_, trial.id);
    const Json head = TrialHead(plan_, trial);
    for (const auto& [key, value] : head.items()) {
      stored[key] = value;
    }
    WriteFileAtomically(WritableTrialFolder(folder_, trial.id) / "trial.json",
                        TrialText(std::move(stored), Maker::kAsBefore));
  }

  // Reports progress each second until all threads have ended.
  void WatchUntilEnded(std::size_t threads) {
    std::unique_lock lock(mutex_);
    while (ended_ < threads) {
      ReportProgress("");
      thread_ended_.wait_for(lock, std::chrono::seconds(1), [&] { return ended_ == threads; });
    }
  }

  void Work() {
    while (!context_.stop_token.stop_requested() && !broken_flag_) {
      const std::size_t n = next_++;
      if (n >= queue_.size()) {
        return;
      }
      try {
        RunTrial(*queue_[n]);
      } catch (const Cancelled&) {
        return;
      } catch (...) {  // invariant 9
        const std::lock_guard lock(mutex_);
        broken_ = std::current_exception();
        broken_flag_ = true;
      }
    }
  }

  // Writes the files of a trial other than trial.json.
  using Files = std::function<void(OutputFolder&)>;

  void RunTrial(const StudyTrial& trial) {
    Json json = TrialHead(plan_, trial);
    Files write = [](OutputFolder&) {};
    try {
      write = plan_.job == StudyJob::kFace    ? RunFace(trial, json)
              : plan_.job == StudyJob::kDepth ? RunDepth(trial, json)
                                              : RunIdentify(trial, json);
    } catch (const Cancelled&) {
      throw;
    } catch (const std::bad_alloc&) {
      Fail(
          "not enough memory for this trial; run fewer trials at a time (--jobs), or lower its "
          "resolution",
          json);
    } catch (const ExternalFailure& failure) {
      Fail(failure.what(), json);
      write = [traceback = failure.traceback()](OutputFolder& output) {
        output.Write(kTraceback, traceback, Durability::kUnsynced);
      };
    } catch (const std::exception& error) {
      Fail(error.what(), json);
    }
    RequireSameInputs(trial.experiment, plan_.contents);
    for (const GalleryEntry& person : plan_.gallery) {
      RequireSameInputs(person.experiment, plan_.contents);
    }
    AppendProvenance(trial, *plan_.contents.hashes, json);
    OutputFolder output(WritableTrialFolder(folder_, trial.id), WhenNotEmpty::kReplaceFiles);
    fs::remove(output.Root() / kTraceback);  // of an earlier try
    write(output);
    std::vector<std::string> names = output.Written();
    std::erase(names, "timing.json");  // invariant 5
    std::erase(names, kTraceback);
    if (!names.empty()) {
      json["files"] = ListHashes(output.Root(), names);
    }
    // Invariants 2 and 3.
    output.Write("trial.json", TrialText(json, Maker::kThisProgram),
                 plan_.keep == TrialFiles::kSummary ? Durability::kUnsynced : Durability::kSynced);
    CountTrial(trial, json);
  }

  static void SetStatus(const std::vector<std::string>& faults, Json& json) {
    json["status"] = faults.empty() ? "done" : "unusable";
    if (!faults.empty()) {
      json["reason"] = fmt::format("{}", fmt::join(faults, "; "));
    }
  }

  static void Fail(const std::string& reason, Json& json) {
    json["status"] = "failed";
    json["reason"] = reason;
    json.erase("result");
  }

  RunContext Quiet() const {
    RunContext quiet;
    quiet.stop_token = context_.stop_token;
    return quiet;
  }

  // Drops the bust unless the files of a run are kept: no number is measured on it.
  Experiment WithoutUnusedBust(Experiment experiment) const {
    if (plan_.keep != TrialFiles::kRun) {
      experiment.bust = NoBust{};
    }
    return experiment;
  }

  // Adds the numbers of the caller's metrics; null for NaN.
  void AddOwnMetrics(const MeasuredTrial& trial, Json& result) const {
    std::vector<double> values;
    for (const OwnMetric& metric : plan_.own_metrics) {
      values.push_back(metric.measure(trial));
    }
    for (std::size_t k = 0; k < values.size(); ++k) {
      result[plan_.own_metrics[k].name] = std::isfinite(values[k]) ? Json(values[k]) : Json();
    }
  }

  Files RunFace(const StudyTrial& trial, Json& json) {
    auto result = std::make_shared<const RunResult>(
        problems::Run(WithoutUnusedBust(trial.experiment), Quiet(), &cache_));
    SetStatus(result->Faults(), json);
    json["result"] = ResultJson(trial.experiment, *result);
    AddOwnMetrics({.run = result.get(), .numbers = json["result"]}, json["result"]);
    return FilesOfRun(trial, result);
  }

  Files RunIdentify(const StudyTrial& trial, Json& json) {
    const auto own = std::ranges::find(plan_.gallery, trial.subject, &GalleryEntry::name);
    if (own == plan_.gallery.end()) {
      throw InputError(
          fmt::format("{} is not in the gallery, because files of the study's base are missing",
                      trial.subject));
    }
    auto result = std::make_shared<const IdentifyResult>(Identify(
        WithoutUnusedBust(trial.experiment), plan_.gallery,
        static_cast<std::size_t>(own - plan_.gallery.begin()), plan_.identify, Quiet(), cache_));
    SetStatus(result->run.Faults(), json);
    json["result"] = IdentifyResultJson(trial.experiment, *result);
    AddOwnMetrics({.run = &result->run, .numbers = json["result"]}, json["result"]);
    return FilesOfRun(trial, {result, &result->run});
  }

  Files FilesOfRun(const StudyTrial& trial, const std::shared_ptr<const RunResult>& result) const {
    return [this, &trial, result](OutputFolder& output) {
      const RunContext quiet;
      if (plan_.keep == TrialFiles::kRun) {
        WriteRun(trial.experiment, *result, output, quiet);
      }
      output.Write("timing.json", TimingJson(result->times), Durability::kUnsynced);
      if (plan_.keep == TrialFiles::kView) {
        output.Write("scene.json", SceneJson(*result, quiet));
      }
    };
  }

  Files RunDepth(const StudyTrial& trial, Json& json) {
    auto result =
        std::make_shared<const DepthResult>(MeasureDepth(trial.experiment, Quiet(), &cache_));
    SetStatus(result->Faults(), json);
    json["result"] = DepthResultJson(trial.experiment, *result);
    AddOwnMetrics({.depth = result.get(), .numbers = json["result"]}, json["result"]);
    return [this, &trial, result](OutputFolder& output) {
      if (plan_.keep == TrialFiles::kRun) {
        WriteDepth(trial.experiment, *result, output, {});
      }
      output.Write("timing.json", TimingJson(result->times), Durability::kUnsynced);
      if (plan_.keep == TrialFiles::kView && trial.subject == plan_.trials.front().subject) {
        output.Write("depth.png", DepthPicture(*result, 1));
      }
    };
  }

  void CountTrial(const StudyTrial& trial, const Json& json) {
    const std::lock_guard lock(mutex_);
    ++(json["status"] == "failed" ? summary_.failed : summary_.done);
    const std::string reason =
        json.contains("reason") ? ": " + json["reason"].get<std::string>() : "";
    ReportProgress(fmt::format("{}: {} {}{}", json["status"].get<std::string>(), trial.subject,
                               fmt::join(trial.values, " "), reason));
  }

  // The caller holds mutex_.
  void ReportProgress(const std::string& trial) {
    if (options_.on_progress) {
      const double elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
      options_.on_progress({.trials = summary_.trials,
                            .finished = summary_.done + summary_.failed + summary_.skipped,
                            .finished_before = summary_.skipped,
                            .failed = summary_.failed,
                            .elapsed_s = elapsed_s},
                           trial);
    }
  }

  using Clock = std::chrono::steady_clock;
  const Clock::time_point start_ = Clock::now();
  const StudyPlan& plan_;
  fs::path folder_;
  const StudyRunOptions& options_;
  const RunContext& context_;
  StageCache cache_;
  std::vector<const StudyTrial*> queue_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> broken_flag_ = false;
  std::mutex mutex_;
  std::condition_variable thread_ended_;
  std::size_t ended_ = 0;  // number of threads that have ended
  std::exception_ptr broken_;
  StudySummary summary_;
};

std::string PlanJson(const StudyPlan& plan) {
  Json json = {{"title", plan.title}, {"hash", plan.hash},       {"metric", plan.metric},
               {"axes", plan.axes},   {"trials", Json::array()}, {"notes", plan.notes},
               {"tags", plan.tags}};
  for (const StudyTrial& trial : plan.trials) {
    json["trials"].push_back(
        {{"id", trial.id}, {"subject", trial.subject}, {"values", trial.values}});
  }
  return json.dump(1) + "\n";
}

// Counts the trials of the stored plan that are not in this plan.
int CountLeftOver(const StoredPlan& stored, const StudyPlan& plan) {
  std::set<std::string> ids;
  for (const StudyTrial& trial : plan.trials) {
    ids.insert(trial.id);
  }
  return static_cast<int>(
      std::ranges::count_if(stored.ids, [&](const std::string& id) { return !ids.contains(id); }));
}

// Returns true if the folder holds another plan. Throws IoError if the two plans share no trial.
bool IsChanged(const StoredPlan& stored, const StudyPlan& plan, const fs::path& folder) {
  const bool changed = !stored.hash.empty() && stored.hash != plan.hash;
  if (changed && CountLeftOver(stored, plan) == static_cast<int>(stored.ids.size())) {
    throw IoError(fmt::format(
        "{}: the folder holds another study (plan {}, this is {}), and the two share no "
        "trial, because options or contents of input files{} differ; choose another --out",
        folder.string(), stored.hash, plan.hash,
        plan.own_metrics.empty()
            ? ""
            : ", or the source file of a metric (which counts in every trial)"));
  }
  return changed;
}

// Checks the plans of all folders before anything is written, and returns the text of the plan.
// Shards of one study have plans of the same bytes, which are parsed once.
std::string RequireSamePlan(const fs::path& folder, const std::vector<fs::path>& others) {
  std::string hash = ReadPlanHash(folder), text;
  for (const fs::path& other : others) {
    std::string own_text =
        fs::exists(other / "plan.json") ? ReadFileBytes(other / "plan.json") : "";
    if (!text.empty() && own_text == text) {
      continue;
    }
    const std::string own = ReadPlanHash(other);
    if (own.empty() || (!hash.empty() && own != hash)) {
      throw IoError(
          fmt::format("{}: not a folder of this study (its plan.json is missing or different)",
                      other.string()));
    }
    ReadStudyRows(other);
    hash = own;
    text = std::move(own_text);
  }
  return text;
}

}  // namespace

Rerun ParseRerun(const std::string& name) {
  static const std::map<std::string, Rerun> known = {{"", Rerun::kNothing},
                                                     {"failed", Rerun::kFailed},
                                                     {"unusable", Rerun::kUnusable},
                                                     {"other-versions", Rerun::kOtherVersions},
                                                     {"all", Rerun::kAll}};
  const auto found = known.find(name);
  if (found == known.end()) {
    throw ConfigError(
        fmt::format("rerun: '{}' is none of failed, unusable, other-versions and all", name));
  }
  return found->second;
}

StudySummary RunStudy(const StudyPlan& plan, const fs::path& folder, const StudyRunOptions& options,
                      const RunContext& context) {
  SelectTrials(plan, options.only);
  NewFolders made(folder);
  OutputFolder output(folder, WhenNotEmpty::kReplaceFiles);
  RefuseLinksBelow(folder, "trials");
  const StoredPlan stored = ReadStoredPlan(folder);
  const bool changed = IsChanged(stored, plan, folder);
  OpenDiskCache(options);  // the last of those that throw before anything is written
  StudyRunner runner(plan, folder, options, context);
  made.Keep();
  output.Write("plan.json", PlanJson(plan));
  runner.Run();
  StudySummary summary = runner.summary();
  summary.changed = changed;
  summary.left_over = CountLeftOver(stored, plan);
  return summary;
}

std::vector<std::string> GatherTrials(const fs::path& folder, const std::vector<fs::path>& others) {
  const std::string plan = RequireSamePlan(folder, others);
  if (!others.empty()) {
    OutputFolder(folder, WhenNotEmpty::kReplaceFiles).Write("plan.json", plan);
  }
  std::vector<std::string> not_taken;
  for (const fs::path& other : others) {
    if (!fs::exists(other / "trials")) {
      continue;
    }
    for (const auto& entry : fs::directory_iterator(other / "trials")) {
      const std::string id = entry.path().filename().string();
      SharedNames none([](std::string_view) { return false; });
      const bool is_there = fs::exists(entry.path() / "trial.json");
      if (is_there && !ReadTrial(folder, id, TrialCheck::kAll, none).numbers) {
        if (const std::string fault = CopyTrial(other, folder, id); !fault.empty()) {
          not_taken.push_back(fmt::format("{}: not taken: {}", entry.path().string(), fault));
        }
      }
    }
  }
  return not_taken;
}

}  // namespace semblance::problems
