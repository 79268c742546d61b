// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_plan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "problems/config/config_reader.h"
#include "problems/config/value_filter.h"
#include "problems/inputs/input_files.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/study/study_metrics.h"
#include "problems/study/study_rows.h"
#include "surfaces/base/encoding.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

// The experiments' trees that a study file names and edits. Faults go to `errors`.
class SubjectReader {
 public:
  SubjectReader(const StudyFile& study, const ConfigNode& tree, const ConfigNode& defaults,
                ConfigErrors& errors)
      : study_(study), tree_(tree), defaults_(defaults), errors_(errors) {}

  struct All {
    std::vector<SubjectTree> subjects, others, held_out;
  };

  All Read() const {
    const ConfigNode base = ReadBase();
    All all{.subjects = ReadList(study_.subjects, "subjects", base), .others = {}, .held_out = {}};
    if (study_.subjects.empty()) {
      all.subjects.push_back({"base", base});
      Apply(study_.set, all.subjects.back().tree);
    }
    if (study_.identify) {
      all.others = ReadList(study_.identify->others, "identify.others", base);
      RequireOtherNames(all.subjects, all.others, "identify.others");
    }
    if (study_.search) {
      all.held_out = ReadList(study_.search->held_out, "search.held_out", base);
      RequireOtherNames(all.subjects, all.held_out, "search.held_out");
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
      trees.push_back({list[n].name, std::move(tree), list[n].optional, list[n].tags});
    }
    return trees;
  }

  void RequireOtherNames(const std::vector<SubjectTree>& subjects,
                         const std::vector<SubjectTree>& others,
                         const std::string& list_path) const {
    for (std::size_t n = 0; n < others.size(); ++n) {
      if (std::ranges::find(subjects, others[n].name, &SubjectTree::name) != subjects.end()) {
        Fail(JoinPath(list_path, n),
             fmt::format("'{}' is one of the subjects already; take one out", others[n].name));
      }
    }
  }

  void Fail(std::string_view path, std::string_view what) const {
    errors_.Add(LocationOf(tree_, path), path, what);
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
  const ConfigNode& tree_;  // of the file, for places
  const ConfigNode& defaults_;
  ConfigErrors& errors_;
};

// The option paths that the rows set, in the order in which they occur.
std::vector<std::string> AxesOf(const std::vector<StudyRow>& rows) {
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
  for (const StudyTrial& trial : trials) {
    for (const fs::path& file : InputFilesOf(trial.experiment)) {
      if (!fs::exists(file)) {
        missing.insert(file.string());
      }
    }
  }
  return missing;
}

// What the results of a study's trials rest on beside their experiments; empty for job: face.
std::string CommonPart(const StudyPlan& plan, ExperimentHash& hash) {
  std::string common = plan.job == StudyJob::kDepth ? "depth" : "";
  if (plan.job == StudyJob::kIdentify) {
    common = fmt::format("identify {} {} {}", plan.identify.ceiling_cell_mm,
                         plan.identify.ceiling_noise_mm, plan.identify.random_seed);
    for (const GalleryEntry& person : plan.gallery) {
      common += person.name + hash(person.experiment);
    }
  }
  return common;
}

// Gives each trial its id; two of one id are a fault.
void NameTrials(const fs::path& file, StudyPlan& plan, TrialFaults& faults) {
  ExperimentHash hash;
  plan.common = CommonPart(plan, hash);
  std::map<std::string, std::size_t> first;
  std::string ids;
  for (std::size_t n = 0; n < plan.trials.size(); ++n) {
    StudyTrial& trial = plan.trials[n];
    trial.id = TrialId(trial.experiment, plan.common, hash);
    ids += trial.id;
    const auto [it, is_new] = first.emplace(trial.id, n);
    if (!is_new) {
      faults.Add(fmt::format(
          "{}: trials {} and {} are the same experiment (subject {}, {}); take out one value",
          file.string(), it->second + 1, n + 1, trial.subject, fmt::join(trial.values, ", ")));
    }
  }
  ids += plan.common;
  if (plan.search) {
    StudySearch how = plan.search->options;
    how.held_out.clear();  // their experiments are among the ids
    ids += WriteConfig(how);
  }
  plan.hash = Sha256OfText(ids).substr(0, ExperimentHash::kIdDigits);
}

void AddTrials(const fs::path& file, const SubjectTree& subject, const std::vector<StudyRow>& rows,
               const ConfigNode& defaults, StudyPlan& plan, TrialFaults& faults) {
  std::vector<StudyTrial> trials;
  for (const StudyRow& row : rows) {
    trials.push_back(MakeTrial(subject, row, plan.axes, defaults, faults));
  }
  const std::set<std::string> missing = MissingFiles(trials);
  if (missing.empty()) {
    plan.trials.insert(plan.trials.end(), trials.begin(), trials.end());
  } else if (subject.optional) {
    plan.notes.push_back(
        fmt::format("subject {}: skipped, as there is no {}", subject.name, *missing.begin()));
  } else {
    faults.Add(fmt::format("{}: subject {}: no such file: {}", file.string(), subject.name,
                           fmt::join(missing, ", ")));
  }
}

// The person of a subject's tree, where its files are there.
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
    plan.notes.push_back(
        fmt::format("gallery: {}: left out, as there is no {}", person.name, *missing.begin()));
  }
}

bool SearchHasMetric(const StudyFile& study) {
  return study.search && !study.search->metric.empty();
}

std::string MetricOf(const StudyFile& study) {
  return SearchHasMetric(study) ? study.search->metric : study.metric;
}

void CheckMetric(const StudyFile& study, const ConfigNode& tree, ConfigErrors& errors) {
  const char* const path = SearchHasMetric(study) ? "search.metric" : "metric";
  if (const std::string complaint = ComplaintAboutMetric(MetricOf(study), study.job);
      !complaint.empty()) {
    errors.Add(LocationOf(tree, path), path, complaint);
  }
  if (SearchHasMetric(study) && tree.Find("metric") && study.metric != study.search->metric) {
    errors.Add(
        LocationOf(tree, path), path,
        fmt::format("the study's metric is '{}'; a study has one: take one out", study.metric));
  }
}

// The subjects of which the plan has trials.
std::vector<SubjectTree> LeftOf(const std::vector<SubjectTree>& subjects, const StudyPlan& plan) {
  std::vector<SubjectTree> left;
  std::ranges::copy_if(subjects, std::back_inserter(left), [&](const SubjectTree& subject) {
    return std::ranges::find(plan.trials, subject.name, &StudyTrial::subject) != plan.trials.end();
  });
  return left;
}

// The base as it stands, on all subjects; and whether what the search can make of it can be read.
void AddSearch(const fs::path& file, SearchPlan search, const std::vector<SubjectTree>& subjects,
               const std::vector<SubjectTree>& held_out, StudyPlan& plan, TrialFaults& faults) {
  const std::vector<StudyRow> base(1);
  for (const SubjectTree& subject : subjects) {
    AddTrials(file, subject, base, search.defaults, plan, faults);
  }
  const std::size_t first_held_out = plan.trials.size();
  for (const SubjectTree& subject : held_out) {
    AddTrials(file, subject, base, search.defaults, plan, faults);
  }
  for (std::size_t n = first_held_out; n < plan.trials.size(); ++n) {
    plan.trials[n].aside = true;
  }
  search.subjects = LeftOf(subjects, plan);
  search.held_out = LeftOf(held_out, plan);
  if (!search.subjects.empty()) {
    StudyPlan unused{.axes = plan.axes};
    AddTrials(file, search.subjects[0], RowsToCheck(search), search.defaults, unused, faults);
    if (const std::string complaint =
            ComplaintAboutShortRuns(search, plan.job, plan.trials[0].experiment);
        !complaint.empty()) {
      faults.Add(fmt::format("{}: search.method: {}", file.string(), complaint));
    }
  }
  plan.search = std::make_shared<const SearchPlan>(std::move(search));
}

bool HasSkin(const StudyTrial& trial) {
  const auto* files = std::get_if<FileSubject>(&trial.experiment.subject);
  return !files || !files->skin.empty();  // a phantom and a CT have theirs
}

bool NoneHasSkin(const StudyPlan& plan) { return std::ranges::none_of(plan.trials, HasSkin); }

// What a condition can ask of a trial.
NamedValues ValuesOf(const StudyPlan& plan, const StudyTrial& trial) {
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

// Whether someone is left to try on; those held out of a search are not.
bool NoSubjectIsLeft(const StudyPlan& plan) {
  return plan.search ? plan.search->subjects.empty() : plan.trials.empty();
}

// Whether someone is left, with what the metric needs.
void CheckSubjects(const fs::path& file, const ConfigNode& tree, WithoutSubjects without_subjects,
                   StudyPlan& plan, TrialFaults& faults) {
  constexpr const char* kNone = "no subject is left; all are optional and lack files";
  if (NoSubjectIsLeft(plan) && without_subjects == WithoutSubjects::kNote) {
    plan.notes.emplace_back(kNone);
  } else if (NoSubjectIsLeft(plan)) {
    faults.Add(fmt::format("{}: {}", file.string(), kNone));
  } else if (NeedsTrueSkin(plan.metric) && NoneHasSkin(plan)) {
    faults.Add(fmt::format(
        "{}: metric: '{}' is measured against the true skin, which no subject has; name the skins "
        "(subject.skin), or another metric",
        ToText(LocationOf(tree, "metric")), plan.metric));
  }
}

// The file as it stands, of a size that can be planned.
StudyFile ReadSizedFile(const fs::path& file, ConfigNode& tree, ConfigErrors& errors) {
  StudyFile study = ReadStudyFile(file, tree, errors);
  if (const std::string complaint = ComplaintAboutSize(study); !complaint.empty()) {
    errors.Add(tree.location, "", complaint);
    errors.ThrowIfAny();
  }
  return study;
}

// Without axes and trials.
StudyPlan EmptyPlan(const StudyFile& study) {
  StudyPlan plan{
      .title = study.title, .metric = MetricOf(study), .keep = study.keep, .job = study.job};
  plan.tags = study.tags;
  return plan;
}

}  // namespace

StudyPlan ReadStudy(const fs::path& file, WithoutSubjects without_subjects) {
  ConfigErrors errors;
  ConfigNode tree;
  const StudyFile study = ReadSizedFile(file, tree, errors);
  const ConfigNode defaults = ConfigTreeOf(Experiment{});
  CheckMetric(study, tree, errors);
  TrialFaults faults;
  ConfigErrors of_bases;
  const auto [subjects, others, held_out] = SubjectReader(study, tree, defaults, of_bases).Read();
  const std::vector<StudyRow> rows = StudyRows(study, errors);
  SearchPlan search;
  if (study.search) {
    search = MakeSearchPlan(*study.search, tree, errors);
    search.defaults = defaults;
  }
  faults.Add(errors);
  faults.Add(of_bases);
  if (of_bases.size() > 0 || (study.search && errors.size() > 0)) {
    faults.ThrowIfAny();  // the trials would repeat what is wrong with their base and axes
  }

  StudyPlan plan = EmptyPlan(study);
  plan.axes = study.search ? search.axes : AxesOf(rows);
  if (study.search) {
    AddSearch(file, std::move(search), subjects, held_out, plan, faults);
  } else {
    for (const SubjectTree& subject : subjects) {
      AddTrials(file, subject, rows, defaults, plan, faults);
    }
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

std::vector<bool> TrialsThat(const StudyPlan& plan, const std::string& condition) {
  if (condition.empty()) {
    return std::vector<bool>(plan.trials.size(), true);
  }
  std::vector<std::string> names = {"subject", "tag", "id"};
  names.insert(names.end(), plan.axes.begin(), plan.axes.end());
  const ValueFilter filter(condition, names);
  std::vector<bool> chosen;
  for (const StudyTrial& trial : plan.trials) {
    chosen.push_back(filter.Holds(ValuesOf(plan, trial)));
  }
  if (std::ranges::find(chosen, true) == chosen.end()) {
    throw InputError(
        fmt::format("{}: none of the {} trials is so; `semblance study plan` lists their values",
                    condition, plan.trials.size()));
  }
  return chosen;
}

}  // namespace semblance
