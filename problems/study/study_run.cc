// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <ctime>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <system_error>
#include <thread>

#include "problems/inputs/input_files.h"
#include "problems/output/file_hashes.h"
#include "problems/output/manifest.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/report/run_folder.h"
#include "problems/report/scene_json.h"
#include "problems/report/timing_json.h"
#include "problems/study/depth_study.h"
#include "problems/study/identify_study.h"
#include "problems/study/study_metrics.h"
#include "problems/study/study_tables.h"
#include "problems/study/trial_folder.h"
#include "surfaces/base/atomic_file.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The status of a finished trial; nothing if it is not there or not whole.
std::optional<std::string> StatusOf(const fs::path& folder, const std::string& id) {
  const auto json = ReadTrialFile(folder, id);
  return json ? std::optional(json->value("status", "failed")) : std::nullopt;
}

Json TrialHead(const StudyPlan& plan, const StudyTrial& trial) {
  Json json = {{"id", trial.id}, {"subject", trial.subject}, {"axes", Json::object()}};
  for (std::size_t k = 0; k < plan.axes.size(); ++k) {
    json["axes"][plan.axes[k]] = trial.values[k];
  }
  return json;
}

// What identifies how a trial came about. Inputs by name and content: folders differ by machine.
void AppendProvenance(const StudyTrial& trial, FileHashes& hashes, Json& json) {
  std::string config = WriteConfig(trial.experiment);
  json["inputs"] = Json::array();
  for (const fs::path& file : InputFilesOf(trial.experiment)) {
    for (const fs::path& part : fs::is_directory(file) ? VolumeFiles(file) : std::vector{file}) {
      json["inputs"].push_back({{"file", part.filename().string()}, {"sha256", hashes.Of(part)}});
    }
    for (std::size_t at = config.find(file.string()); at != config.npos;
         at = config.find(file.string(), at)) {
      config.replace(at, file.string().size(), file.filename().string());
    }
  }
  json["config"] = config;
  json["version"] = SEMBLANCE_VERSION;
  json["libraries"] = Json::object();
  for (const auto& [name, version] : LibraryVersions()) {
    json["libraries"][name] = version;
  }
}

double ThreadCpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::shared_ptr<const DiskCache> CacheOnDisk(const StudyRunOptions& options) {
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
        cache_(4 * options.jobs + 6, CacheOnDisk(options)) {}

  // The trials of this shard.
  void Run() {
    const std::vector<bool> chosen = SelectTrials(plan_, options_.only);
    for (std::size_t n = 0; n < plan_.trials.size(); ++n) {
      if (static_cast<int>(n % options_.shards) == options_.shard && chosen[n]) {
        Queue(plan_.trials[n]);
      }
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
      }  // else the system gives no more of them: those that are there do the work
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
  void Queue(const StudyTrial& trial) {
    ++summary_.trials;
    std::optional<Json> there = ReadTrialFile(folder_, trial.id);
    if (there && !IsAskedAgain(there->value("status", "failed")) && HasWhatIsKept(trial, *there)) {
      TellAxesOfNow(trial, *there);
      ++summary_.skipped;
    } else {
      queue_.push_back(&trial);
    }
  }

  bool IsAskedAgain(const std::string& status) const {
    return options_.rerun == Rerun::kAll ||
           (status == "failed" && options_.rerun != Rerun::kNothing) ||
           (status == "unusable" && options_.rerun == Rerun::kUnusable);
  }

  // Whether the trial's folder has the files that `keep` asks for, which may have asked for less
  // when it ran.
  bool HasWhatIsKept(const StudyTrial& trial, const Json& there) const {
    const bool is_depth = plan_.job == StudyJob::kDepth;
    const bool has_none = there.value("status", "failed") == "failed" ||
                          (plan_.keep == TrialFiles::kView && is_depth &&
                           trial.subject != plan_.trials.front().subject);
    const char* file = plan_.keep == TrialFiles::kRun    ? "result.json"
                       : plan_.keep == TrialFiles::kView ? (is_depth ? "depth.png" : "scene.json")
                                                         : "trial.json";
    return has_none || fs::exists(TrialFolder(folder_, trial.id) / file);
  }

  // A trial of an earlier plan says the axes of that plan.
  void TellAxesOfNow(const StudyTrial& trial, Json& there) const {
    const Json head = TrialHead(plan_, trial);
    bool is_otherwise = false;
    for (const auto& [key, value] : head.items()) {
      is_otherwise = is_otherwise || !there.contains(key) || there[key] != value;
      there[key] = value;
    }
    if (is_otherwise) {
      WriteFileAtomically(TrialFolder(folder_, trial.id) / "trial.json", there.dump(1) + "\n");
    }
  }

  void WatchUntilEnded(std::size_t threads) {
    std::unique_lock lock(mutex_);
    while (ended_ < threads) {
      TellProgress("");
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
      } catch (...) {  // the folder cannot be written: no trial can
        const std::lock_guard lock(mutex_);
        broken_ = std::current_exception();
        broken_flag_ = true;
      }
    }
  }

  // What a trial leaves beside trial.json.
  using Files = std::function<void(OutputFolder&)>;

  void RunTrial(const StudyTrial& trial) {
    Json json = TrialHead(plan_, trial);
    Files write = [](OutputFolder&) {};
    const double cpu_before_s = ThreadCpu_s();
    try {
      write = plan_.job == StudyJob::kFace    ? Face(trial, cpu_before_s, json)
              : plan_.job == StudyJob::kDepth ? Depth(trial, cpu_before_s, json)
                                              : Identity(trial, cpu_before_s, json);
    } catch (const Cancelled&) {
      throw;
    } catch (const std::bad_alloc&) {
      Fail("not enough memory for this trial; run fewer at a time (--jobs), or ask it for less",
           json);
    } catch (const std::exception& error) {
      Fail(error.what(), json);
    }
    AppendProvenance(trial, input_hashes_, json);
    OutputFolder output(TrialFolder(folder_, trial.id), WhenNotEmpty::kReplaceFiles);
    write(output);
    std::vector<std::string> names = output.Written();
    std::erase(names, "timing.json");  // differs from run to run
    if (!names.empty()) {
      json["files"] = HashesOf(output.Root(), names);
    }
    // Last: it says that the trial is whole. A broken one counts as none; with other files beside
    // it, it must not outlast them.
    output.Write("trial.json", json.dump(1) + "\n",
                 plan_.keep == TrialFiles::kSummary ? Durability::kUnsynced : Durability::kSynced);
    Tell(trial, json);
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

  // A bust is for those who open a run's folder; nothing is measured on it.
  Experiment AsLookedAt(Experiment experiment) const {
    if (plan_.keep != TrialFiles::kRun) {
      experiment.bust = NoBust{};
    }
    return experiment;
  }

  Files Face(const StudyTrial& trial, double cpu_before_s, Json& json) {
    auto result = std::make_shared<const RunResult>(
        semblance::Run(AsLookedAt(trial.experiment), Quiet(), &cache_));
    SetStatus(result->Faults(), json);
    json["result"] = ResultJson(trial.experiment, *result);
    return FilesOfRun(trial, result, ThreadCpu_s() - cpu_before_s);
  }

  Files Identity(const StudyTrial& trial, double cpu_before_s, Json& json) {
    const auto own = std::ranges::find(plan_.gallery, trial.subject, &GalleryEntry::name);
    if (own == plan_.gallery.end()) {
      throw InputError(fmt::format(
          "{} is not in the gallery, as files of the study's base are missing", trial.subject));
    }
    auto result = std::make_shared<const IdentifyResult>(Identify(
        AsLookedAt(trial.experiment), plan_.gallery,
        static_cast<std::size_t>(own - plan_.gallery.begin()), plan_.identify, Quiet(), cache_));
    SetStatus(result->run.Faults(), json);
    json["result"] = IdentifyResultJson(trial.experiment, *result);
    return FilesOfRun(trial, {result, &result->run}, ThreadCpu_s() - cpu_before_s);
  }

  Files FilesOfRun(const StudyTrial& trial, const std::shared_ptr<const RunResult>& result,
                   double cpu_s) const {
    return [this, &trial, result, cpu_s](OutputFolder& output) {
      const RunContext quiet;
      if (plan_.keep == TrialFiles::kRun) {
        WriteRun(trial.experiment, *result, output, quiet);
      }
      output.Write("timing.json", TimingJson(result->times, cpu_s), Durability::kUnsynced);
      if (plan_.keep == TrialFiles::kView) {
        output.Write("scene.json", SceneJson(*result, quiet));
      }
    };
  }

  Files Depth(const StudyTrial& trial, double cpu_before_s, Json& json) {
    auto result =
        std::make_shared<const DepthResult>(MeasureDepth(trial.experiment, Quiet(), &cache_));
    SetStatus(result->Faults(), json);
    json["result"] = DepthResultJson(trial.experiment, *result);
    const double cpu_s = ThreadCpu_s() - cpu_before_s;
    return [this, &trial, result, cpu_s](OutputFolder& output) {
      if (plan_.keep == TrialFiles::kRun) {
        WriteDepth(trial.experiment, *result, output, {});
      }
      output.Write("timing.json", TimingJson(result->times, cpu_s), Durability::kUnsynced);
      if (plan_.keep == TrialFiles::kView && trial.subject == plan_.trials.front().subject) {
        const std::string title =
            fmt::format("{}: {}", trial.subject, TreatmentLabel(plan_.axes, trial.values));
        output.Write("depth.png", DepthPicture(*result, title, 1));
      }
    };
  }

  void Tell(const StudyTrial& trial, const Json& json) {
    const std::lock_guard lock(mutex_);
    ++(json["status"] == "failed" ? summary_.failed : summary_.done);
    const std::string reason =
        json.contains("reason") ? ": " + json["reason"].get<std::string>() : "";
    TellProgress(fmt::format("{}: {} {}{}", json["status"].get<std::string>(), trial.subject,
                             fmt::join(trial.values, " "), reason));
  }

  // With mutex_ held.
  void TellProgress(const std::string& trial) {
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
  FileHashes input_hashes_;
  std::vector<const StudyTrial*> queue_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> broken_flag_ = false;
  std::mutex mutex_;
  std::condition_variable thread_ended_;
  std::size_t ended_ = 0;  // of the threads
  std::exception_ptr broken_;
  StudySummary summary_;
};

// plan.json as text.
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

// The trials of an earlier plan that are none of this one.
int CountLeftOver(const PlanThere& there, const StudyPlan& plan) {
  std::set<std::string> ids;
  for (const StudyTrial& trial : plan.trials) {
    ids.insert(trial.id);
  }
  return static_cast<int>(
      std::ranges::count_if(there.ids, [&](const std::string& id) { return !ids.contains(id); }));
}

// Whether the folder was begun with another plan. Throws IoError if that has no trial of this one.
bool IsChanged(const PlanThere& there, const StudyPlan& plan, const fs::path& folder) {
  const bool changed = !there.hash.empty() && there.hash != plan.hash;
  if (changed && CountLeftOver(there, plan) == static_cast<int>(there.ids.size())) {
    throw IoError(
        fmt::format("{}: the folder holds another study (plan {}, this is {}), of which no trial "
                    "is one of this; choose another --out",
                    folder.string(), there.hash, plan.hash));
  }
  return changed;
}

// All that can be wrong with the plans, before anything is written.
void RequirePlanOf(const fs::path& folder, const std::vector<fs::path>& others) {
  std::string hash = PlanHashOf(folder);
  for (const fs::path& other : others) {
    const std::string own = PlanHashOf(other);
    if (own.empty() || (!hash.empty() && own != hash)) {
      throw IoError(fmt::format("{}: no folder of this study (its plan.json is missing or another)",
                                other.string()));
    }
    ReadStudyResults(other);
    hash = own;
  }
}

}  // namespace

StudySummary RunStudy(const StudyPlan& plan, const fs::path& folder, const StudyRunOptions& options,
                      const RunContext& context) {
  SelectTrials(plan, options.only);  // what is wrong with it is said before anything is written,
  CacheOnDisk(options);            // and so is what is wrong with the cache
  OutputFolder output(folder, WhenNotEmpty::kReplaceFiles);
  const PlanThere there = ReadPlanThere(folder);
  const bool changed = IsChanged(there, plan, folder);
  StudyRunner runner(plan, folder, options, context);
  output.Write("plan.json", PlanJson(plan));
  runner.Run();
  StudySummary summary = runner.summary();
  summary.changed = changed;
  summary.left_over = CountLeftOver(there, plan);
  return summary;
}

std::vector<std::string> GatherTrials(const fs::path& folder, const std::vector<fs::path>& others) {
  RequirePlanOf(folder, others);
  std::vector<std::string> not_taken;
  for (const fs::path& other : others) {
    OutputFolder output(folder, WhenNotEmpty::kReplaceFiles);
    output.Write("plan.json", ReadFileBytes(other / "plan.json"));
    if (!fs::exists(other / "trials")) {
      continue;
    }
    for (const auto& entry : fs::directory_iterator(other / "trials")) {
      const std::string id = entry.path().filename().string();
      if (StatusOf(other, id) && !StatusOf(folder, id)) {
        if (const std::string fault = CopyTrial(other, folder, id); !fault.empty()) {
          not_taken.push_back(fmt::format("{}: not taken: {}", entry.path().string(), fault));
        }
      }
    }
  }
  return not_taken;
}

}  // namespace semblance
