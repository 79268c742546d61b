// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/compare/study_comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "problems/report/plain_names.h"
#include "problems/study/study_metrics.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

constexpr int kFewestForTest = 6;

// The last `parts` names of a path.
std::string EndOf(const fs::path& path, int parts) {
  fs::path end;
  fs::path rest = path;
  for (int n = 0; n < parts && rest.has_filename(); ++n) {
    end = end.empty() ? rest.filename() : rest.filename() / end;
    rest = rest.parent_path();
  }
  return end.string();
}

std::vector<std::string> NamesOf(const std::vector<fs::path>& folders) {
  for (int parts = 1;; ++parts) {
    std::vector<std::string> names;
    for (const fs::path& folder : folders) {
      names.push_back(EndOf(folder, parts));
    }
    if (std::set(names.begin(), names.end()).size() == names.size()) {
      return names;
    }
  }
}

// The subjects of which the study has the metric.
std::set<std::string> SubjectsOf(const NamedStudy& study, const std::string& metric) {
  std::set<std::string> subjects;
  for (const TrialRow& row : study.results.trials) {
    if (row.status == "done" && row.metrics.contains(metric)) {
      subjects.insert(row.subject);
    }
  }
  if (subjects.empty()) {
    throw InputError(fmt::format(
        "{}: no trial that is done has the number '{}'; name another with --metric (trials.csv "
        "lists them)",
        study.name, metric));
  }
  return subjects;
}

std::vector<std::string> CommonSubjects(std::span<const NamedStudy> studies,
                                        const std::string& metric) {
  std::set<std::string> common = SubjectsOf(studies.front(), metric);
  for (const NamedStudy& study : studies.subspan(1)) {
    const std::set<std::string> others = SubjectsOf(study, metric);
    std::erase_if(common, [&](const std::string& subject) { return !others.contains(subject); });
  }
  if (common.empty()) {
    throw InputError(
        "the studies have no subject in common, and treatments are compared over the same "
        "subjects; give the subjects the same names");
  }
  return {common.begin(), common.end()};
}

double MeanCost(const ComparedTreatment& treatment, const Preference& preference) {
  double sum = 0;
  for (const auto& [subject, value] : treatment.by_subject) {
    sum += preference.CostOf(value);
  }
  return sum / static_cast<double>(treatment.by_subject.size());
}

std::vector<ComparedTreatment> TreatmentsOf(const NamedStudy& study,
                                            const StudyComparison& comparison) {
  const std::vector<std::string>& subjects = comparison.subjects;
  std::vector<ComparedTreatment> compared;
  for (const Treatment& treatment : Treatments(study.results, comparison.metric)) {
    ComparedTreatment one{
        .study = study.name, .label = treatment.label, .by_subject = {}, .summary = {}};
    std::vector<double> values;
    for (const auto& [subject, value] : treatment.by_subject) {
      if (std::ranges::binary_search(subjects, subject)) {
        one.by_subject[subject] = value;
        values.push_back(value);
      }
    }
    one.summary = Summarize(values);
    compared.push_back(std::move(one));
  }
  const auto cost = [&](const ComparedTreatment& t) { return MeanCost(t, comparison.preference); };
  std::ranges::stable_sort(compared, [&](const auto& a, const auto& b) {
    return a.summary.n > 0 && (b.summary.n == 0 || cost(a) < cost(b));
  });
  return compared;
}

TreatmentPair Pair(const ComparedTreatment& reference, const ComparedTreatment& other,
                   const Preference& preference) {
  TreatmentPair pair{.reference = reference,
                     .other = other,
                     .same_label = reference.label == other.label,
                     .difference = {},
                     .test = {}};
  std::vector<double> differences;
  for (const auto& [subject, value] : other.by_subject) {
    if (const auto before = reference.by_subject.find(subject);
        before != reference.by_subject.end()) {
      differences.push_back(preference.Compared(value) - preference.Compared(before->second));
      pair.better += preference.IsBetter(differences.back(), 0) ? 1 : 0;
      pair.worse += preference.IsBetter(0, differences.back()) ? 1 : 0;
    }
  }
  pair.difference = Summarize(differences);
  if (pair.difference.n >= kFewestForTest) {
    pair.test = Wilcoxon(differences);
  }
  return pair;
}

void AdjustTests(std::vector<TreatmentPair>& pairs) {
  std::vector<double> p;
  std::vector<TreatmentPair*> tested;
  for (TreatmentPair& pair : pairs) {
    if (pair.test.n > 0) {
      tested.push_back(&pair);
      p.push_back(pair.test.p);
    }
  }
  const std::vector<double> adjusted = Holm(p);
  for (std::size_t k = 0; k < tested.size(); ++k) {
    tested[k]->p_holm = adjusted[k];
  }
}

// The areas of all studies, as if they were one.
std::vector<std::string> NotesOn(std::span<const NamedStudy> studies, const std::string& metric,
                                 const std::vector<std::string>& subjects) {
  StudyResults all;
  all.metric = metric;
  std::vector<std::string> notes;
  for (const NamedStudy& study : studies) {
    std::ranges::copy_if(
        study.results.trials, std::back_inserter(all.trials),
        [&](const TrialRow& row) { return std::ranges::binary_search(subjects, row.subject); });
    const auto left = SubjectsOf(study, metric).size() - subjects.size();
    if (left > 0) {
      notes.push_back(fmt::format("{}: left out, for they are not in all the studies: {}",
                                  study.name, Counted(static_cast<long long>(left), "subject")));
    }
    const int not_done =
        static_cast<int>(study.results.trials.size()) - study.results.Count("done");
    if (not_done > 0) {
      notes.push_back(fmt::format("{}: not done, and without a part: {} of {}", study.name,
                                  not_done, Counted(std::ssize(study.results.trials), "trial")));
    }
  }
  std::ranges::copy(AreaNotes(all), std::back_inserter(notes));
  return notes;
}

}  // namespace

std::vector<NamedStudy> ReadStudies(const std::vector<fs::path>& folders) {
  std::vector<fs::path> real;
  for (const fs::path& folder : folders) {
    std::error_code ignored;
    fs::path path = fs::weakly_canonical(fs::absolute(folder), ignored);
    path = path.has_filename() ? path : path.parent_path();
    if (std::ranges::find(real, path) != real.end()) {
      throw InputError(fmt::format("{}: this folder appears twice", folder.string()));
    }
    real.push_back(path);
  }
  const std::vector<std::string> names = NamesOf(real);
  std::vector<NamedStudy> studies;
  for (std::size_t k = 0; k < real.size(); ++k) {
    studies.push_back({names[k], ReadStudyResults(folders[k]), folders[k]});
  }
  return studies;
}

// Of the studies' own metric they have said it; of another one its name does.
Better BetterIn(std::span<const NamedStudy* const> studies, const std::string& metric) {
  const NamedStudy* teller = nullptr;
  const auto taken = [](const NamedStudy* study) { return study->results.preference.better; };
  const auto word = [&](const NamedStudy* study) {
    return EnumNames(Better())[static_cast<std::size_t>(taken(study))];
  };
  for (const NamedStudy* study : studies) {
    if (study->results.metric != metric) {
      continue;
    }
    if (teller != nullptr && taken(teller) != taken(study)) {
      throw InputError(fmt::format(
          "'{}': {} took {} values of it as better, and {} {} ones; say which are with --better",
          metric, teller->name, word(teller), study->name, word(study)));
    }
    teller = study;
  }
  return teller == nullptr ? BetterOf(metric) : taken(teller);
}

StudyComparison CompareStudies(std::span<const NamedStudy> studies, const CompareOptions& options) {
  if (studies.size() < 2) {
    throw InputError("one study alone cannot be compared; name two folders or more");
  }
  const std::string metric =
      options.metric.empty() ? studies.front().results.metric : options.metric;
  std::vector<const NamedStudy*> each;
  for (const NamedStudy& study : studies) {
    each.push_back(&study);
  }
  const Better better = options.better ? *options.better : BetterIn(each, metric);
  StudyComparison comparison{.metric = metric,
                             .preference = PreferenceFor(metric, better),
                             .studies = {},
                             .subjects = {},
                             .treatments = {},
                             .pairs = {},
                             .notes = {}};
  comparison.subjects = CommonSubjects(studies, metric);
  const std::vector<ComparedTreatment> first = TreatmentsOf(studies.front(), comparison);
  for (const NamedStudy& study : studies) {
    comparison.studies.push_back(study.name);
    for (ComparedTreatment& treatment : TreatmentsOf(study, comparison)) {
      if (&study != &studies.front()) {
        const auto same = std::ranges::find(first, treatment.label, &ComparedTreatment::label);
        comparison.pairs.push_back(
            Pair(same == first.end() ? first.front() : *same, treatment, comparison.preference));
      }
      comparison.treatments.push_back(std::move(treatment));
    }
  }
  AdjustTests(comparison.pairs);
  comparison.notes = NotesOn(studies, metric, comparison.subjects);
  return comparison;
}

}  // namespace semblance
