// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "problems/config/config_reader.h"
#include "problems/output/manifest.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/study/study_rows.h"
#include "surfaces/base/atomic_file.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

// One subject of the study: the experiment with what is its own.
struct StudySubject {
  std::string name;
  ConfigNode tree;
  bool optional = false;
};

// The trees that the rows are laid over, and the words of what goes wrong.
class StudyReader {
 public:
  explicit StudyReader(fs::path file) : file_(std::move(file)) {}

  StudyPlan Read() {
    const ConfigSource source{.name = file_.string(), .folder = fs::absolute(file_).parent_path()};
    study_ = ParseConfigText(ReadFileBytes(file_), source, errors_);
    if (!study_.IsMap()) {
      errors_.Add(study_.place, "", "a map with base, subjects, grid, zip, list or sample is due");
      errors_.ThrowIfAny();
    }
    ReadHead();
    const std::vector<StudySubject> subjects = ReadSubjects(ReadBase());
    const std::vector<StudyRow> rows = StudyRows(study_, errors_);
    errors_.ThrowIfAny();
    NameAxes(rows);
    for (const StudySubject& subject : subjects) {
      AddTrials(subject, rows);
    }
    Finish();
    return std::move(plan_);
  }

 private:
  void ReadHead() {
    const std::vector<std::string> known = {"title", "base",   "set",    "subjects", "grid", "zip",
                                            "list",  "sample", "metric", "keep",     "job"};
    const FieldInfo info;
    RefuseUnknownKeys(errors_, {study_, "", info}, known);
    if (const ConfigNode* title = study_.Find("title")) {
      ReadScalar(errors_, {*title, "title", info}, plan_.title);
    }
    if (const ConfigNode* metric = study_.Find("metric")) {
      ReadScalar(errors_, {*metric, "metric", info}, plan_.metric);
    }
    ReadChoice("keep", plan_.keep);
    ReadChoice("job", plan_.job);
  }

  template <class Choice>
  void ReadChoice(const char* key, Choice& choice) {
    if (const ConfigNode* node = study_.Find(key)) {
      constexpr auto kNames = EnumNames(Choice{});
      const std::vector<std::string> words(kNames.begin(), kNames.end());
      const FieldInfo info;
      choice =
          static_cast<Choice>(ReadWord(errors_, {*node, key, info}, "word", words).value_or(0));
    }
  }

  // The tree of an experiment's file that `node` names, relative to the study.
  ConfigNode LoadExperiment(const ConfigNode& node, const std::string& path) {
    fs::path file;
    const FieldInfo info;
    ReadScalar(errors_, {node, path, info}, file);
    if (file.empty() || !fs::is_regular_file(file)) {
      errors_.Add(node.place, path,
                  fmt::format("'{}' cannot be read; paths are relative to this file", node.text));
      return ConfigNode::Map();
    }
    return LoadConfigTree(file.lexically_proximate(fs::current_path()), {}, defaults_, errors_);
  }

  ConfigNode ReadBase() {
    const ConfigNode* base = study_.Find("base");
    if (!base) {
      errors_.Add(study_.place, "base", "the file of an experiment is due, which the trials vary");
      return ConfigNode::Map();
    }
    return LoadExperiment(*base, "base");
  }

  // What the whole study sets, over the base and below the subjects.
  ConfigNode WithSettings(ConfigNode tree, const ConfigNode& owner, const std::string& path) {
    const ConfigNode* set = owner.Find("set");
    const FieldInfo info;
    if (set && RequireMap(errors_, {*set, JoinPath(path, "set"), info})) {
      for (const ConfigNode::Entry& entry : set->entries) {
        Set({entry.key, entry.key_place, entry.value}, tree, errors_);
      }
    }
    return tree;
  }

  std::vector<StudySubject> ReadSubjects(const ConfigNode& base) {
    const ConfigNode* list = study_.Find("subjects");
    if (!list) {
      return {{"base", WithSettings(base, study_, "")}};
    }
    std::vector<StudySubject> subjects;
    const FieldInfo info{.name = "subjects", .min = 1};
    if (RequireList(errors_, {*list, "subjects", info}) &&
        RequireSize(errors_, {*list, "subjects", info}, std::nullopt)) {
      for (std::size_t n = 0; n < list->items.size(); ++n) {
        ReadSubject(list->items[n], JoinPath("subjects", n), base, subjects);
      }
    }
    return subjects;
  }

  void ReadSubject(const ConfigNode& node, const std::string& path, const ConfigNode& base,
                   std::vector<StudySubject>& subjects) {
    const FieldInfo info;
    const std::vector<std::string> known = {"name", "base", "set", "optional"};
    if (!RequireMap(errors_, {node, path, info})) {
      return;
    }
    RefuseUnknownKeys(errors_, {node, path, info}, known);
    StudySubject subject{"", base};
    if (const ConfigNode* name = node.Find("name")) {
      ReadScalar(errors_, {*name, JoinPath(path, "name"), info}, subject.name);
    }
    const bool is_new = std::none_of(subjects.begin(), subjects.end(),
                                     [&](const auto& s) { return s.name == subject.name; });
    if (subject.name.empty() || !is_new) {
      errors_.Add(node.place, path, "a name of its own is due");
    }
    if (const ConfigNode* optional = node.Find("optional")) {
      ReadScalar(errors_, {*optional, JoinPath(path, "optional"), info}, subject.optional);
    }
    if (const ConfigNode* file = node.Find("base")) {
      subject.tree = MergeTrees(subject.tree, LoadExperiment(*file, JoinPath(path, "base")));
    }
    subject.tree = WithSettings(WithSettings(subject.tree, study_, ""), node, path);
    subjects.push_back(std::move(subject));
  }

  void Set(const StudySetting& setting, ConfigNode& tree, ConfigErrors& errors) {
    try {
      SetPath(tree, setting.path, setting.value, &defaults_);
    } catch (const ConfigError& error) {
      errors.Add(setting.path_place, "", error.what());
    }
  }

  void NameAxes(const std::vector<StudyRow>& rows) {
    for (const StudyRow& row : rows) {
      for (const StudySetting& setting : row) {
        if (std::find(plan_.axes.begin(), plan_.axes.end(), setting.path) == plan_.axes.end()) {
          plan_.axes.push_back(setting.path);
        }
      }
    }
  }

  // A value in short: a bare strategy by its name, one with options with them behind it.
  static std::string Label(const ConfigNode& value) {
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

  void AddTrials(const StudySubject& subject, const std::vector<StudyRow>& rows) {
    std::set<std::string> missing;
    std::vector<StudyTrial> trials;
    for (const StudyRow& row : rows) {
      ConfigErrors errors;
      ConfigNode tree = subject.tree;
      StudyTrial trial{"", subject.name, std::vector<std::string>(plan_.axes.size()), {}};
      for (const StudySetting& setting : row) {
        Set(setting, tree, errors);
        const auto axis = std::find(plan_.axes.begin(), plan_.axes.end(), setting.path);
        trial.values[axis - plan_.axes.begin()] = Label(setting.value);
      }
      trial.experiment = ReadConfigTree<Experiment>(tree, errors);
      Collect(errors);
      for (const fs::path& file : InputFilesOf(trial.experiment)) {
        if (!fs::exists(file)) {
          missing.insert(file.string());
        }
      }
      trials.push_back(std::move(trial));
    }
    if (missing.empty()) {
      plan_.trials.insert(plan_.trials.end(), trials.begin(), trials.end());
    } else if (subject.optional) {
      plan_.notes.push_back(
          fmt::format("subject {}: skipped, as there is no {}", subject.name, *missing.begin()));
    } else {
      faults_.push_back(fmt::format("{}: subject {}: no such file: {}", file_.string(),
                                    subject.name, fmt::join(missing, ", ")));
    }
  }

  // Many trials share a wrong value; it is said once.
  void Collect(const ConfigErrors& errors) {
    try {
      errors.ThrowIfAny();
    } catch (const ConfigError& error) {
      std::istringstream lines(error.what());
      for (std::string line; std::getline(lines, line);) {
        if (std::find(faults_.begin(), faults_.end(), line) == faults_.end()) {
          faults_.push_back(line);
        }
      }
    }
  }

  std::string FileHash(const fs::path& file) {
    auto& hash = file_hashes_[file.string()];
    return hash = hash.empty() ? Sha256OfFile(file) : hash;
  }

  // The resolved experiment with each input file by what is in it.
  std::string IdOf(const Experiment& experiment) {
    std::string text = WriteConfig(experiment);
    for (const fs::path& file : InputFilesOf(experiment)) {
      const std::string name = file.string(), hash = "sha256:" + FileHash(file);
      for (std::size_t at = text.find(name); at != text.npos; at = text.find(name, at)) {
        text.replace(at, name.size(), hash);
      }
    }
    return Sha256OfText(text).substr(0, 12);
  }

  void Finish() {
    if (plan_.trials.empty() && faults_.empty()) {
      faults_.push_back(
          fmt::format("{}: no subject is left; all are optional and lack files", file_.string()));
    }
    if (!faults_.empty()) {
      throw ConfigError(fmt::format("{}", fmt::join(faults_, "\n")));
    }
    std::map<std::string, int> first;
    std::string ids;
    for (std::size_t n = 0; n < plan_.trials.size(); ++n) {
      StudyTrial& trial = plan_.trials[n];
      trial.id = IdOf(trial.experiment);
      ids += trial.id;
      const auto [it, is_new] = first.emplace(trial.id, static_cast<int>(n));
      if (!is_new) {
        faults_.push_back(fmt::format(
            "{}: trials {} and {} are the same experiment (subject {}, {}); take out one value",
            file_.string(), it->second + 1, n + 1, trial.subject, fmt::join(trial.values, ", ")));
      }
    }
    if (!faults_.empty()) {
      throw ConfigError(fmt::format("{}", fmt::join(faults_, "\n")));
    }
    if (plan_.job == StudyJob::kDepth) {
      ids += "depth";
    }
    plan_.hash = Sha256OfText(ids).substr(0, 12);
  }

  fs::path file_;
  ConfigNode study_;
  const ConfigNode defaults_ = ConfigTreeOf(Experiment{});
  ConfigErrors errors_;
  std::vector<std::string> faults_;
  std::map<std::string, std::string> file_hashes_;
  StudyPlan plan_;
};

std::vector<fs::path> FilesOf(const PhantomOptions&) { return {}; }
std::vector<fs::path> FilesOf(const FileSubject& o) { return {o.skull, o.skin, o.landmarks}; }
std::vector<fs::path> FilesOf(const CtSubject& o) { return {o.volume, o.landmarks}; }

}  // namespace

StudyPlan ReadStudy(const fs::path& file) { return StudyReader(file).Read(); }

std::vector<fs::path> InputFilesOf(const Experiment& experiment) {
  std::vector<fs::path> files =
      std::visit([](const auto& subject) { return FilesOf(subject); }, experiment.subject);
  files.push_back(experiment.network);
  if (experiment.tissue.depths == DepthSource::kTable) {
    files.push_back(experiment.tissue.table);
  }
  if (const auto* map = std::get_if<DepthMap>(&experiment.interp)) {
    files.push_back(map->file);
    files.push_back(map->mesh);
  }
  std::erase(files, fs::path());
  return files;
}

}  // namespace semblance
