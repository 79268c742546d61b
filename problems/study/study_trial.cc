// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_trial.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "problems/inputs/input_files.h"
#include "problems/pipeline/experiment_config.h"
#include "surfaces/base/encoding.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

// A value in short: a bare strategy by its name, one with options with them behind it.
std::string Label(const ConfigNode& value) {
  const ConfigNode* type = value.IsMap() ? value.Find("type") : nullptr;
  if (!type) {
    return value.IsScalar() ? value.text : ToFlowYaml(value);
  }
  std::string label = type->text;
  for (const ConfigNode::Entry& entry : value.entries) {
    if (entry.key != "type") {
      label += fmt::format(" {}={}", entry.key, Label(entry.value));
    }
  }
  return label;
}

}  // namespace

void TrialFaults::Add(const std::string& line) {
  if (std::find(lines_.begin(), lines_.end(), line) == lines_.end()) {
    lines_.push_back(line);
  }
}

void TrialFaults::Add(const ConfigErrors& errors) {
  try {
    errors.ThrowIfAny();
  } catch (const ConfigError& error) {
    std::istringstream lines(error.what());
    for (std::string line; std::getline(lines, line);) {
      Add(line);
    }
  }
}

void TrialFaults::ThrowIfAny() const {
  if (!lines_.empty()) {
    throw ConfigError(fmt::format("{}", fmt::join(lines_, "\n")));
  }
}

StudyTrial MakeTrial(const SubjectTree& subject, const StudyRow& row,
                     const std::vector<std::string>& axes, const ConfigNode& defaults,
                     TrialFaults& faults) {
  ConfigErrors errors;
  ConfigNode tree = subject.tree;
  StudyTrial trial{"", subject.name, std::vector<std::string>(axes.size()), {}, subject.tags};
  for (const OptionSetting& setting : row) {
    ApplySetting(setting, defaults, tree, errors);
    const auto axis = std::find(axes.begin(), axes.end(), setting.key);
    trial.values[static_cast<std::size_t>(axis - axes.begin())] = Label(setting.value);
  }
  trial.experiment = ReadConfigTree<Experiment>(tree, errors);
  faults.Add(errors);
  if (!trial.experiment.alternatives.empty()) {
    faults.Add(fmt::format(
        "{}: alternatives: they are for a run; a study varies by its axes. Write `alternatives: "
        "[]` in what it sets",
        subject.name));
  }
  return trial;
}

std::string ExperimentHash::operator()(const Experiment& experiment) {
  std::string text = WriteConfig(experiment);
  for (const fs::path& file : InputFilesOf(experiment)) {
    const std::string name = file.string(), hash = "sha256:" + HashOf(file);
    for (std::size_t at = text.find(name); at != text.npos; at = text.find(name, at)) {
      text.replace(at, name.size(), hash);
    }
  }
  return Sha256OfText(text).substr(0, kIdDigits);
}

// Of a folder (a DICOM series): that of the hashes of its files.
std::string ExperimentHash::HashOf(const fs::path& file) {
  if (!fs::is_directory(file)) {
    return files_.Of(file);
  }
  std::string all;
  for (const fs::path& part : VolumeFiles(file)) {
    all += files_.Of(part);
  }
  return Sha256OfText(all);
}

std::string TrialId(const Experiment& experiment, const std::string& common, ExperimentHash& hash) {
  const std::string own = hash(experiment);
  return common.empty() ? own : Sha256OfText(own + common).substr(0, ExperimentHash::kIdDigits);
}

}  // namespace semblance
