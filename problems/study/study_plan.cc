// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_plan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "problems/config/config_reader.h"
#include "problems/config/terminal_text.h"
#include "problems/config/utf8_check.h"
#include "problems/config/value_filter.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/input_contents.h"
#include "problems/experiment/input_files.h"
#include "problems/study/study_metrics.h"
#include "surfaces/base/encoding.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// A subject of the study, with the tree of the experiment that its trials vary.
struct SubjectTree {
  std::string name;
  ConfigNode tree;
  bool optional = false;
  std::vector<std::string> tags = {};
};

// Labels a value: a strategy by its name, followed by the options that it sets.
std::string Label(const ConfigNode& value) {
  const ConfigNode* type = value.IsMap() ? value.Find("type") : nullptr;
  if (!type) {
    return value.IsScalar() ? PlainText(Normalized(value.text)) : ToFlowYaml(value);
  }
  std::string label = type->text;
  for (const ConfigNode::Entry& entry : value.entries) {
    if (entry.key != "type") {
      label += fmt::format(" {}={}", entry.key, Label(entry.value));
    }
  }
  return label;
}

// The faults of all trials. Many trials share a fault, so each line is kept once.
class TrialFaults {
 public:
  void Add(const std::string& line) {
    if (std::ranges::find(lines_, line) == lines_.end()) {
      lines_.push_back(line);
    }
  }

  void Add(const ConfigErrors& errors) {
    try {
      errors.ThrowIfAny();
    } catch (const ConfigError& error) {
      std::istringstream lines(error.what());
      for (std::string line; std::getline(lines, line);) {
        Add(line);
      }
    }
  }

  // Throws ConfigError with one line per fault.
  void ThrowIfAny() const {
    if (!lines_.empty()) {
      throw ConfigError(fmt::format("{}", fmt::join(lines_, "\n")));
    }
  }

 private:
  std::vector<std::string> lines_;
};

// Puts the subject's name into the name of a depth map's file, so that one value of a grid names a
// file per subject.
void NameSubjectsMap(const std::string& subject, ConfigNode& tree) {
  constexpr std::string_view kSubject = "{subject}";
  ConfigNode* const interp = tree.Find("interp");
  ConfigNode* const file = interp == nullptr ? nullptr : interp->Find("file");
  if (file == nullptr) {
    return;
  }
  std::string& text = file->text;
  for (std::size_t at = text.find(kSubject); at != text.npos;
       at = text.find(kSubject, at + subject.size())) {
    text.replace(at, kSubject.size(), subject);
  }
}

// Makes a trial without an id. `axes` are the option paths that the rows of the study set.
StudyTrial MakeTrial(const SubjectTree& subject, const StudyRow& row,
                     const std::vector<std::string>& axes, const ConfigNode& defaults,
                     const StudyPlugins& plugins, TrialFaults& faults) {
  ConfigErrors errors;
  ConfigNode tree = subject.tree;
  StudyTrial trial{"", subject.name, std::vector<std::string>(axes.size()), {}, subject.tags};
  for (const OptionSetting& setting : row) {
    ApplySetting(setting, defaults, tree, errors);
    const auto axis = std::find(axes.begin(), axes.end(), setting.key);
    trial.values[static_cast<std::size_t>(axis - axes.begin())] = Label(setting.value);
  }
  NameSubjectsMap(subject.name, tree);
  trial.experiment = ReadExperimentTree(std::move(tree), plugins.schemes, errors);
  faults.Add(errors);
  if (!trial.experiment.alternatives.empty()) {
    faults.Add(
        fmt::format("{}: alternatives: only a run has them, and a study varies by its axes; write "
                    "`alternatives: []` under its `set`",
                    subject.name));
  }
  return trial;
}

std::string ShortHash(const std::string& text) {
  constexpr std::size_t kDigits = 12;  // 48 bits: 100,000 trials collide with a chance of 2e-5
  return Sha256OfText(text).substr(0, kDigits);
}

// Hashes a resolved experiment with the contents of its input files, so that the hash is the same
// on every machine. Each content is hashed once. The title changes no result, so that equal
// treatments have one id whatever they are called.
std::string HashExperiment(Experiment experiment, InputContents& contents) {
  experiment.title = Experiment().title;
  return ShortHash(ToFlowYaml(
      WithInputs(MakeConfigTree(experiment), NamedFiles(experiment), [&](const NamedFile& input) {
        const auto [known, is_new] = contents.by_input.try_emplace({input.option, input.file});
        if (is_new) {
          known->second = HashContent(input, *contents.hashes);
        }
        return known->second;
      })));
}

// Reads the trees of the experiments that a study file names, and edits them as it says. Adds
// faults to `errors`.
class SubjectReader {
 public:
  SubjectReader(const StudyFile& study, const ConfigNode& tree, const ConfigNode& defaults,
                ConfigErrors& errors)
      : study_(study), tree_(tree), defaults_(defaults), errors_(errors) {}

  struct All {
    std::vector<SubjectTree> subjects, others;
  };

  All Read() const {
    const ConfigNode base = ReadBase();
    All all{.subjects = ReadList(study_.subjects, "subjects", base), .others = {}};
    if (study_.subjects.empty()) {
      all.subjects.push_back({"base", base});
      Apply(study_.set, all.subjects.back().tree);
    }
    if (study_.identify) {
      all.others = ReadList(study_.identify->others, "identify.others", base);
      RequireOtherNames(all.subjects, all.others);
    }
    return all;
  }

 private:
  std::vector<SubjectTree> ReadList(const std::vector<StudySubject>& list,
                                    const std::string& list_path, const ConfigNode& base) const {
    std::vector<SubjectTree> trees;
    for (std::size_t n = 0; n < list.size(); ++n) {
      const std::string path = JoinPath(list_path, n);
      RequireOwnName(list, n, path);
      ConfigNode tree = base;
      if (!list[n].base.empty()) {
        tree = MergeTrees(std::move(tree), Load(list[n].base, JoinPath(path, "base")));
      }
      Apply(study_.set, tree);
      Apply(list[n].set, tree);
      trees.push_back({PlainText(list[n].name), std::move(tree), list[n].optional, list[n].tags});
    }
    return trees;
  }

  void RequireOtherNames(const std::vector<SubjectTree>& subjects,
                         const std::vector<SubjectTree>& others) const {
    for (std::size_t n = 0; n < others.size(); ++n) {
      if (std::ranges::find(subjects, others[n].name, &SubjectTree::name) != subjects.end()) {
        Fail(JoinPath("identify.others", n),
             fmt::format("'{}' is one of the subjects already; take one out", others[n].name));
      }
    }
  }

  void Fail(std::string_view path, std::string_view what) const {
    errors_.Add(FindLocation(tree_, path), path, what);
  }

  ConfigNode ReadBase() const {
    if (study_.base.empty()) {
      Fail("base", "the file of an experiment is missing; name the one that the trials vary");
      return ConfigNode::Map();
    }
    return Load(study_.base, "base");
  }

  void RequireOwnName(const std::vector<StudySubject>& list, std::size_t n,
                      const std::string& path) const {
    const std::string& name = list[n].name;
    const auto begin = list.begin();
    if (name.empty()) {
      Fail(path, "the subject has no name; give it one");
    } else if (std::any_of(begin, begin + static_cast<std::ptrdiff_t>(n),
                           [&](const StudySubject& other) { return other.name == name; })) {
      Fail(path, fmt::format("the name '{}' appears twice; give each subject its own", name));
    }
  }

  ConfigNode Load(const fs::path& file, const std::string& path) const {
    const fs::path shown = file.lexically_proximate(fs::current_path());
    if (!fs::is_regular_file(file)) {
      Fail(path, fmt::format("'{}' cannot be read; paths are relative to the study's file",
                             shown.string()));
      return ConfigNode::Map();
    }
    return LoadConfigTree(shown, {}, defaults_, errors_);
  }

  void Apply(const OptionValues& values, ConfigNode& tree) const {
    for (const OptionSetting& setting : values.entries) {
      ApplySetting(setting, defaults_, tree, errors_);
    }
  }

  const StudyFile& study_;
  const ConfigNode& tree_;  // tree of the study file, for locations
  const ConfigNode& defaults_;
  ConfigErrors& errors_;
};

// Collects the option paths that the rows set, in the order of their first occurrence.
std::vector<std::string> CollectAxes(const std::vector<StudyRow>& rows) {
  std::vector<std::string> axes;
  for (const StudyRow& row : rows) {
    for (const OptionSetting& setting : row) {
      if (std::find(axes.begin(), axes.end(), setting.key) == axes.end()) {
        axes.push_back(setting.key);
      }
    }
  }
  return axes;
}

std::set<std::string> MissingFiles(const std::vector<StudyTrial>& trials) {
  std::set<std::string> missing;
  std::set<fs::path> known;  // trials share most inputs
  for (const StudyTrial& trial : trials) {
    for (const NamedFile& input : NamedInputs(trial.experiment)) {
      if (!known.insert(input.file).second) {
        continue;
      }
      for (const fs::path& part : ListParts(input)) {
        if (!fs::exists(part)) {
          missing.insert(part.string());
        }
      }
    }
  }
  return missing;
}

// Describes everything besides the experiment that the results of a trial depend on. Empty for
// `job: face` without metrics of the caller.
std::string CommonPart(StudyPlan& plan) {
  std::string common = plan.job == StudyJob::kDepth ? "depth" : "";
  if (plan.job == StudyJob::kIdentify) {
    common = fmt::format("identify {} {} {}", plan.identify.ceiling_cell_mm,
                         plan.identify.ceiling_noise_mm, plan.identify.random_seed);
    for (const GalleryEntry& person : plan.gallery) {
      common += "\n" + person.name + "\n" + HashExperiment(person.experiment, plan.contents);
    }
  }
  for (const OwnMetric& metric : plan.own_metrics) {
    common += fmt::format("\n{} {}", metric.name, metric.source_hash);
  }
  return common;
}

// Gives each trial its id. Two trials with one id are a fault.
void NameTrials(const fs::path& file, StudyPlan& plan, TrialFaults& faults) {
  const std::string common = CommonPart(plan);
  std::map<std::string, std::size_t> first;
  std::string ids;
  for (std::size_t n = 0; n < plan.trials.size(); ++n) {
    StudyTrial& trial = plan.trials[n];
    const std::string own = HashExperiment(trial.experiment, plan.contents);
    trial.id = common.empty() ? own : ShortHash(own + common);
    ids += trial.id;
    const auto [it, is_new] = first.emplace(trial.id, n);
    if (!is_new) {
      faults.Add(fmt::format(
          "{}: trials {} and {} are the same experiment (subject {}, {}); take out one value",
          file.string(), it->second + 1, n + 1, trial.subject, fmt::join(trial.values, ", ")));
    }
  }
  plan.hash = ShortHash(ids + common);
}

void AddTrials(const fs::path& file, const SubjectTree& subject, const std::vector<StudyRow>& rows,
               const ConfigNode& defaults, const StudyPlugins& plugins, StudyPlan& plan,
               TrialFaults& faults) {
  std::vector<StudyTrial> trials;
  for (const StudyRow& row : rows) {
    trials.push_back(MakeTrial(subject, row, plan.axes, defaults, plugins, faults));
  }
  const std::set<std::string> missing = MissingFiles(trials);
  if (missing.empty()) {
    plan.trials.insert(plan.trials.end(), trials.begin(), trials.end());
  } else if (subject.optional) {
    plan.notes.push_back(fmt::format("subject {}: skipped, because {} does not exist", subject.name,
                                     *missing.begin()));
  } else {
    faults.Add(fmt::format("{}: subject {}: no such file: {}", file.string(), subject.name,
                           fmt::join(missing, ", ")));
  }
}

// Adds a person to the gallery if all files exist.
void AddToGallery(const fs::path& file, const SubjectTree& person, StudyPlan& plan,
                  TrialFaults& faults) {
  ConfigErrors errors;
  StudyTrial as_trial{"", person.name, {}, ReadConfigTree<Experiment>(person.tree, errors), {}};
  faults.Add(errors);
  const std::set<std::string> missing = MissingFiles({as_trial});
  if (missing.empty()) {
    plan.gallery.push_back({person.name, std::move(as_trial.experiment)});
  } else if (!person.optional) {
    faults.Add(fmt::format("{}: gallery: {}: no such file: {}", file.string(), person.name,
                           fmt::join(missing, ", ")));
  } else {
    plan.notes.push_back(fmt::format("gallery: {}: left out, because {} does not exist",
                                     person.name, *missing.begin()));
  }
}

void CheckMetric(const StudyFile& study, const ConfigNode& tree, const StudyPlugins& plugins,
                 ConfigErrors& errors) {
  if (const std::string complaint = ComplaintAboutMetric(study.metric, study.job, plugins.metrics);
      !complaint.empty()) {
    errors.Add(FindLocation(tree, "metric"), "metric", complaint);
  }
}

bool HasSkin(const StudyTrial& trial) {
  const auto* files = std::get_if<FileSubject>(&trial.experiment.subject);
  return !files || !files->skin.empty();  // a phantom and a CT always have one
}

bool NoneHasSkin(const StudyPlan& plan) { return std::ranges::none_of(plan.trials, HasSkin); }

// Collects the named values of a trial for a condition.
NamedValues CollectValues(const StudyPlan& plan, const StudyTrial& trial) {
  NamedValues values = {{"subject", trial.subject}, {"id", trial.id}};
  for (const std::string& tag : trial.tags) {
    values.emplace("tag", tag);
  }
  for (std::size_t k = 0; k < plan.axes.size(); ++k) {
    if (!trial.values[k].empty()) {
      values.emplace(plan.axes[k], trial.values[k]);
    }
  }
  return values;
}

void AddGallery(const fs::path& file, std::initializer_list<const std::vector<SubjectTree>*> groups,
                StudyPlan& plan, TrialFaults& faults) {
  for (const auto* people : groups) {
    for (const SubjectTree& person : *people) {
      AddToGallery(file, person, plan, faults);
    }
  }
}

// Checks that a subject is left, and that one has the true skin if the metric needs it.
void CheckSubjects(const fs::path& file, const ConfigNode& tree, WithoutSubjects without_subjects,
                   StudyPlan& plan, TrialFaults& faults) {
  constexpr const char* kNone = "no subject is left; all are optional and lack files";
  if (plan.trials.empty() && without_subjects == WithoutSubjects::kNote) {
    plan.notes.emplace_back(kNone);
  } else if (plan.trials.empty()) {
    faults.Add(fmt::format("{}: {}", file.string(), kNone));
  } else if (NeedsTrueSkin(plan.metric) && NoneHasSkin(plan)) {
    faults.Add(fmt::format(
        "{}: metric: '{}' is measured against the true skin, which no subject has; name the skins "
        "(subject.skin), or another metric",
        ToText(FindLocation(tree, "metric")), plan.metric));
  }
}

// Throws ConfigError if the study names plugins that are not loaded. Without them every use of a
// name of theirs would be a fault of its own.
void RequireLoaded(const StudyFile& study, const fs::path& file, const ConfigNode& tree,
                   const StudyPlugins& plugins, ConfigErrors& errors) {
  if (!study.plugins.empty() && !plugins.are_files_loaded) {
    errors.Add(FindLocation(tree, "plugins"), "plugins",
               fmt::format("'{}' is written in Python, which this program does not load; run "
                           "`python3 -m semblance study {}`",
                           study.plugins.front().filename().string(), file.string()));
    errors.ThrowIfAny();
  }
}

// Reads the study file. Throws ConfigError at once if it makes too many trials to expand, or if its
// plugins are not loaded.
StudyFile ReadSizedFile(const fs::path& file, const StudyPlugins& plugins, ConfigNode& tree,
                        ConfigErrors& errors) {
  StudyFile study = ReadStudyFile(file, tree, errors);
  RequireLoaded(study, file, tree, plugins, errors);
  if (const std::string complaint = ComplaintAboutSize(study); !complaint.empty()) {
    errors.Add(tree.location, "", complaint);
    errors.ThrowIfAny();
  }
  return study;
}

// Makes a plan without axes and trials.
StudyPlan MakeEmptyPlan(const StudyFile& study, const StudyPlugins& plugins) {
  StudyPlan plan{.title = PlainText(study.title),
                 .metric = study.metric,
                 .keep = study.keep,
                 .job = study.job,
                 .own_metrics = plugins.metrics};
  std::ranges::transform(study.tags, std::back_inserter(plan.tags), PlainText);
  return plan;
}

}  // namespace

StudyPlan ReadStudy(const fs::path& file, WithoutSubjects without_subjects,
                    const StudyPlugins& plugins) {
  CheckSchemeNames(plugins.schemes);
  ConfigErrors errors;
  ConfigNode tree;
  const StudyFile study = ReadSizedFile(file, plugins, tree, errors);
  CheckMetricNames(plugins.metrics, study.job);
  const ConfigNode defaults = MakeConfigTree(Experiment{});
  CheckMetric(study, tree, plugins, errors);
  TrialFaults faults;
  ConfigErrors base_errors;
  const auto [subjects, others] = SubjectReader(study, tree, defaults, base_errors).Read();
  const std::vector<StudyRow> rows = MakeStudyRows(study, errors);
  faults.Add(errors);
  faults.Add(base_errors);
  if (base_errors.size() > 0) {
    faults.ThrowIfAny();  // the trials would repeat the faults of their base
  }

  StudyPlan plan = MakeEmptyPlan(study, plugins);
  plan.axes = CollectAxes(rows);
  for (const SubjectTree& subject : subjects) {
    AddTrials(file, subject, rows, defaults, plugins, plan, faults);
  }
  if (study.job == StudyJob::kIdentify) {
    plan.identify = study.identify.value_or(IdentifyOptions{});
    AddGallery(file, {&subjects, &others}, plan, faults);
  }
  faults.ThrowIfAny();
  CheckSubjects(file, tree, without_subjects, plan, faults);
  NameTrials(file, plan, faults);
  faults.ThrowIfAny();
  return plan;
}

std::vector<bool> SelectTrials(const StudyPlan& plan, const std::string& condition) {
  if (condition.empty()) {
    return std::vector<bool>(plan.trials.size(), true);
  }
  std::vector<std::string> names = {"subject", "tag", "id"};
  names.insert(names.end(), plan.axes.begin(), plan.axes.end());
  const ValueFilter filter(condition, names);
  std::vector<bool> chosen;
  for (const StudyTrial& trial : plan.trials) {
    chosen.push_back(filter.Holds(CollectValues(plan, trial)));
  }
  if (std::ranges::find(chosen, true) == chosen.end()) {
    throw InputError(fmt::format(
        "{}: this holds for none of the {} trials; `semblance study plan` lists their values",
        condition, plan.trials.size()));
  }
  return chosen;
}

}  // namespace semblance::problems
