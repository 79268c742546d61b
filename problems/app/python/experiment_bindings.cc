// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "problems/app/python/bindings.h"
#include "problems/app/python/values.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/input_files.h"
#include "problems/io/staged_folder.h"
#include "problems/report/result_json.h"
#include "problems/report/run_folder.h"
#include "problems/run.h"
#include "problems/study/report/study_report.h"
#include "problems/study/study_run.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;
namespace fs = std::filesystem;

std::vector<std::string> Overrides(const py::dict& set) {
  std::vector<std::string> overrides;
  for (const auto& [path, value] : set) {
    overrides.push_back(std::string(py::str(path)) + "=" + OptionText(value));
  }
  return overrides;
}

WhenNotEmpty MakePolicy(bool force) {
  return force ? WhenNotEmpty::kReplaceFiles : WhenNotEmpty::kRefuse;
}

py::object FromJson(const std::string& text) {
  return py::module_::import("json").attr("loads")(text);
}

// Runs an experiment and returns result.json, the surface and the faults of the result.
py::dict RunConfig(const std::string& config, const py::dict& set,
                   const std::optional<std::string>& out, bool force, int threads) {
  const auto experiment = ReadConfig<Experiment>(config, Overrides(set));
  const RunResult result = Interruptible([&](const std::stop_token& stop) {
    RunContext context;
    context.threads = threads;
    context.stop_token = stop;
    std::optional<StagedFolder> folder;
    if (out) {
      folder.emplace(*out, MakePolicy(force), GivenTo(experiment, config, kRunFiles));
    }
    RunResult found = Run(experiment, context);
    if (folder) {
      WriteRun(experiment, found, folder->Files(), context);
      folder->Publish();
    }
    return found;
  });
  py::dict results;
  results["result"] = FromJson(ResultJson(experiment, result).dump());
  results["surface"] = result.fit.surface;
  results["faults"] = result.Faults();
  return results;
}

// Reads a CSV file as a pandas.DataFrame if pandas is installed, otherwise as a list of
// dictionaries.
py::object ReadTable(const fs::path& csv) {
  try {
    return py::module_::import("pandas").attr("read_csv")(csv.string());
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_ImportError)) {
      throw;
    }
  }
  const py::object file = py::module_::import("builtins").attr("open")(csv.string());
  const py::object rows = py::list(py::module_::import("csv").attr("DictReader")(file));
  file.attr("close")();
  return rows;
}

// Reads the present trials.csv of the folder of a study.
py::object ReadStudyTable(const fs::path& folder) {
  if (!fs::exists(folder / "plan.json")) {
    throw IoError(
        fmt::format("{}: not the folder of a study, because it has no plan.json", folder.string()));
  }
  if (!fs::exists(folder / "trials.csv")) {
    throw IoError(fmt::format(
        "{}: it has no trials.csv yet; `semblance report {}` makes it from the finished trials",
        folder.string(), folder.string()));
  }
  return ReadTable(folder / "trials.csv");
}

py::object RunStudyFile(const std::string& path, const std::optional<std::string>& given,
                        int jobs) {
  if (fs::is_directory(path)) {
    if (given) {
      throw InputError(
          fmt::format("{}: this is the folder of a study, which is only read; omit 'out'", path));
    }
    return ReadStudyTable(path);
  }
  const fs::path out = given ? fs::path(*given) : "out" / fs::path(path).stem();
  const StudyPlan plan = ReadStudy(path);
  StudyRunOptions options;
  options.jobs = jobs;
  Interruptible([&](const std::stop_token& stop) {
    RunContext context;
    context.stop_token = stop;
    RunStudy(plan, out, options, context);
    OutputFolder folder(out, WhenNotEmpty::kReplaceFiles);
    WriteStudyTables(folder);
  });
  return ReadTable(out / "trials.csv");
}

}  // namespace

void BindExperiments(py::module_& module) {
  module.def(
      "run", &RunConfig, py::arg("config"), py::arg("set") = py::dict(),
      py::arg("out") = py::none(), py::arg("force") = false, py::arg("threads") = 1,
      "Runs an experiment, as `semblance run` does. set: options by path, e.g. "
      "{'implicit.resolution': 60}. Returns {'result': result.json, 'surface': HSpline, "
      "'faults': reasons why the result cannot be used, or []}. With `out`, writes the files "
      "of a run to that folder too.");
  module.def(
      "study", &RunStudyFile, py::arg("path"), py::arg("out") = py::none(), py::arg("jobs") = 1,
      "Runs a study, or its unfinished trials, into the folder `out` (default: out/NAME, like "
      "`semblance study NAME.yaml`), and returns trials.csv in long form. If `path` is the "
      "folder of a study, only reads its trials.csv. Returns a pandas.DataFrame if pandas is "
      "installed, otherwise a list of dictionaries.");
}

}  // namespace semblance::problems
