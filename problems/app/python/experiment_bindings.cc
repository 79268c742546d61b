// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "problems/app/python/bindings.h"
#include "problems/app/python/plugins.h"
#include "problems/app/python/values.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/external_schemes.h"
#include "problems/experiment/input_contents.h"
#include "problems/experiment/input_files.h"
#include "problems/experiment/stage_cache.h"
#include "problems/io/staged_folder.h"
#include "problems/report/report_kit.h"
#include "problems/report/result_json.h"
#include "problems/report/run_folder.h"
#include "problems/report/scene_json.h"
#include "problems/run.h"
#include "problems/study/report/study_ranking.h"
#include "problems/study/report/study_report.h"
#include "problems/study/study_run.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;
namespace fs = std::filesystem;

WhenNotEmpty MakePolicy(bool force) {
  return force ? WhenNotEmpty::kReplaceFiles : WhenNotEmpty::kRefuse;
}

// Stages that several calls of run() share. A file that changes between two calls empties it,
// because the keys of stages have paths, not contents. Several threads may use one object.
class SharedStages {
 public:
  explicit SharedStages(int capacity) : capacity_(capacity) { Clear(); }

  void Clear() {
    const std::lock_guard lock(mutex_);
    stages_ = std::make_shared<StageCache>(capacity_);
    contents_.clear();
  }

  // The stages for a run of this experiment, made from its input files as they are now.
  std::shared_ptr<StageCache> For(const Experiment& experiment) {
    InputHashes now;
    for (const NamedFile& input : NamedFiles(experiment)) {
      now[{input.option, input.file}] = HashContent(input, hashes_);
    }
    const std::lock_guard lock(mutex_);
    const bool is_changed = std::ranges::any_of(now, [&](const auto& input) {
      const auto known = contents_.find(input.first);
      return known != contents_.end() && known->second != input.second;
    });
    if (is_changed) {
      stages_ = std::make_shared<StageCache>(capacity_);
      contents_.clear();
    }
    contents_.merge(now);
    return stages_;
  }

  int made() const {
    const std::lock_guard lock(mutex_);
    return stages_->made();
  }

 private:
  const int capacity_;
  FileHashes hashes_;
  mutable std::mutex mutex_;
  std::shared_ptr<StageCache> stages_;
  InputHashes contents_;
};

// Runs an experiment with the stages of earlier ones, if any. A file that changes during the run
// empties them, since a stage may have been made from either content.
RunResult RunShared(const Experiment& experiment, const RunContext& context, SharedStages* shared) {
  if (shared == nullptr) {
    return Run(experiment, context);
  }
  RunResult result = Run(experiment, context, shared->For(experiment).get());
  shared->For(experiment);
  return result;
}

// A page with the 3-D view of a run alone.
std::string ViewPage(const std::string& title, const RunResult& result) {
  Report report;
  report.title = title;
  report.faults = result.Faults();
  report.scenes = CollectScenes({{result.subject.name, SceneJson(result, {})}}, 0).json;
  return ReportHtml(report);
}

// Runs an experiment and returns the text of result.json, the arrays, the faults, and a function
// that makes a page with the 3-D view.
py::dict RunConfig(const std::string& config, const std::vector<std::string>& overrides,
                   const std::optional<std::string>& out, bool force, int threads,
                   const py::iterable& schemes, SharedStages* shared) {
  const std::vector<NamedScheme> named = ReadSchemes(schemes);
  CheckSchemeNames(named);
  const Experiment experiment = ReadExperiment(config, overrides, named);
  auto result = Interruptible([&](const std::stop_token& stop) {
    RunContext context;
    context.threads = RequireAtLeastOne(threads, "threads");
    context.stop_token = stop;
    std::optional<StagedFolder> folder;
    if (out) {
      folder.emplace(*out, MakePolicy(force), GivenTo(experiment, config, kRunFiles));
    }
    auto found = std::make_shared<const RunResult>(RunShared(experiment, context, shared));
    if (folder) {
      WriteRun(experiment, *found, folder->Files(), context);
      folder->Publish();
    }
    return found;
  });
  py::dict parts;
  parts["numbers"] = ResultJson(experiment, *result).dump();
  parts["arrays"] = ResultArrays(*result);
  parts["faults"] = result->Faults();
  parts["page"] = py::cpp_function([title = experiment.title, result] {
    const py::gil_scoped_release release;
    return ViewPage(title, *result);
  });
  return parts;
}

// The files that a study names under `plugins`. Faults of the file are left to ReadStudy.
std::vector<std::string> ListPlugins(const std::string& path) {
  ConfigNode tree;
  ConfigErrors errors;
  std::vector<std::string> files;
  for (const fs::path& file : ReadStudyFile(path, tree, errors).plugins) {
    files.push_back(file.string());
  }
  return files;
}

// Throws IoError unless the folder is that of a study with a trials.csv.
void CheckStudyFolder(const std::string& path) {
  const fs::path folder = path;
  if (!fs::exists(folder / "plan.json")) {
    throw IoError(
        fmt::format("{}: not the folder of a study, because it has no plan.json", folder.string()));
  }
  if (!fs::exists(folder / "trials.csv")) {
    throw IoError(fmt::format(
        "{}: it has no trials.csv yet; `semblance report {}` makes it from the finished trials",
        folder.string(), folder.string()));
  }
}

// Runs a study or a shard of it. Writes the tables unless it is a shard. Returns the counts of
// StudySummary, the ranking as text, and a line per failed trial of the folder.
py::dict RunStudyFile(const std::string& path, const std::string& out, int jobs,
                      std::pair<int, int> shard, const std::string& only,
                      const py::iterable& schemes, const py::iterable& metrics,
                      const std::string& cache, const std::string& rerun) {
  const StudyPlan plan = ReadStudy(
      path, WithoutSubjects::kFault,
      {.schemes = ReadSchemes(schemes), .metrics = ReadMetrics(metrics), .are_files_loaded = true});
  StudyRunOptions options;
  options.jobs = RequireAtLeastOne(jobs, "jobs");
  options.shard = shard.first;
  options.shards = shard.second;
  options.only = only;
  options.cache = cache;
  options.rerun = ParseRerun(rerun);
  std::string ranking;
  std::vector<std::string> failures;
  const StudySummary summary = Interruptible([&](const std::stop_token& stop) {
    RunContext context;
    context.stop_token = stop;
    StudySummary done = RunStudy(plan, out, options, context);
    if (options.shards == 1) {
      OutputFolder folder(out, WhenNotEmpty::kReplaceFiles);
      const StudyResults results = WriteStudyTables(folder);
      ranking = RankingText(results);
      for (const TrialRow& row : results.trials) {
        if (row.status == "failed") {
          failures.push_back(fmt::format("{} {} | {}: {}", row.id, row.subject,
                                         fmt::join(row.values, " | "), row.reason));
        }
      }
    }
    return done;
  });
  py::dict counts;
  counts["trials"] = summary.trials;
  counts["skipped"] = summary.skipped;
  counts["done"] = summary.done;
  counts["failed"] = summary.failed;
  counts["ranking"] = ranking;
  counts["failures"] = failures;
  return counts;
}

}  // namespace

void BindExperiments(py::module_& module) {
  py::class_<SharedStages>(module, "Stages")
      .def(py::init<int>(), py::arg("capacity"))
      .def("clear", &SharedStages::Clear)
      .def_property_readonly("made", &SharedStages::made);
  module.def("run", &RunConfig, py::arg("config"), py::arg("overrides"), py::arg("out"),
             py::arg("force"), py::arg("threads"), py::arg("schemes"),
             py::arg("shared").none(true));
  module.def("list_plugins", &ListPlugins, py::arg("path"));
  module.def("check_study_folder", &CheckStudyFolder, py::arg("path"));
  module.def("study", &RunStudyFile, py::arg("path"), py::arg("out"), py::arg("jobs"),
             py::arg("shard"), py::arg("only"), py::arg("schemes"), py::arg("metrics"),
             py::arg("cache"), py::arg("rerun"));
}

}  // namespace semblance::problems
