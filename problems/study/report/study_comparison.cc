// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/study_comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "problems/report/plain_names.h"
#include "problems/study/study_metrics.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

constexpr int kMinComparedSubjects = 6;  // five cannot reach p < 0.05 in a two-sided test

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

// The shortest ends of the paths that differ from each other.
std::vector<std::string> ShortNames(const std::vector<fs::path>& folders) {
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

// The subjects for which the study has the metric.
std::set<std::string> SubjectsWith(const NamedStudy& study, const std::string& metric) {
  std::set<std::string> subjects;
  for (const TrialRow& row : study.results.trials) {
    if (row.status == "done" && row.metrics.contains(metric)) {
      subjects.insert(row.subject);
    }
  }
  if (subjects.empty()) {
    throw InputError(fmt::format(
        "{}: no finished trial has the number '{}'; choose another with --metric (trials.csv "
        "lists them)",
        study.name, metric));
  }
  return subjects;
}

std::vector<std::string> CommonSubjects(std::span<const NamedStudy> studies,
                                        const std::string& metric) {
  std::set<std::string> common = SubjectsWith(studies.front(), metric);
  for (const NamedStudy& study : studies.subspan(1)) {
    const std::set<std::string> others = SubjectsWith(study, metric);
    std::erase_if(common, [&](const std::string& subject) { return !others.contains(subject); });
  }
  if (common.empty()) {
    throw InputError(
        "the studies have no subject in common, but treatments are compared over the same "
        "subjects; give the subjects the same names");
  }
  return {common.begin(), common.end()};
}

double MeanCost(const ComparedTreatment& treatment, const Preference& preference) {
  double sum = 0;
  for (const auto& [subject, value] : treatment.by_subject) {
    sum += preference.RankingCost(value);
  }
  return sum / static_cast<double>(treatment.by_subject.size());
}

std::vector<ComparedTreatment> ComparedTreatments(const NamedStudy& study,
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
  if (pair.difference.n >= kMinComparedSubjects) {
    pair.test = Wilcoxon(differences);
  }
  return pair;
}

// Each treatment of a later study with one of the first.
std::vector<TreatmentPair> MatchedPairs(const StudyComparison& comparison) {
  const auto& treatments = comparison.treatments;
  const auto is_first = [&](const ComparedTreatment& t) {
    return t.study == comparison.studies.front();
  };
  std::vector<TreatmentPair> pairs;
  for (const ComparedTreatment& other : treatments) {
    if (!is_first(other)) {
      const auto same = std::ranges::find_if(treatments, [&](const ComparedTreatment& t) {
        return is_first(t) && t.label == other.label;
      });
      pairs.push_back(Pair(same == treatments.end() ? treatments.front() : *same, other,
                           comparison.preference));
    }
  }
  return pairs;
}

// Every two treatments.
std::vector<TreatmentPair> AllPairs(const StudyComparison& comparison) {
  constexpr std::size_t kMostPairs = 5000;
  const auto& treatments = comparison.treatments;
  const std::size_t count = treatments.size() * (treatments.size() - 1) / 2;
  if (count > kMostPairs) {
    throw InputError(fmt::format(
        "{} treatments make {} pairs, and at most {} are compared; compare matched pairs alone, or "
        "studies with fewer treatments",
        treatments.size(), count, kMostPairs));
  }
  std::vector<TreatmentPair> pairs;
  for (std::size_t a = 0; a < treatments.size(); ++a) {
    for (std::size_t b = a + 1; b < treatments.size(); ++b) {
      pairs.push_back(Pair(treatments[a], treatments[b], comparison.preference));
    }
  }
  std::ranges::stable_partition(pairs, &TreatmentPair::same_label);
  return pairs;
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

// Notes on left-out subjects and trials, and on areas as if all studies were one.
std::vector<std::string> ComparisonNotes(std::span<const NamedStudy> studies,
                                         const std::string& metric,
                                         const std::vector<std::string>& subjects) {
  StudyResults all;
  all.metric = metric;
  std::vector<std::string> notes;
  for (const NamedStudy& study : studies) {
    std::ranges::copy_if(
        study.results.trials, std::back_inserter(all.trials),
        [&](const TrialRow& row) { return std::ranges::binary_search(subjects, row.subject); });
    const auto left = SubjectsWith(study, metric).size() - subjects.size();
    if (left > 0) {
      notes.push_back(fmt::format("{}: left out because not all studies have them: {}", study.name,
                                  Counted(static_cast<long long>(left), "subject")));
    }
    if (const std::string unusable = UnusableText(study.results); !unusable.empty()) {
      notes.push_back(fmt::format("{}: {}", study.name, unusable));
    }
    const int not_done = static_cast<int>(study.results.trials.size()) -
                         study.results.Count("done") - study.results.Count("unusable");
    for (const std::string& note : VersionNotes(study.results)) {
      notes.push_back(fmt::format("{}: {}", study.name, note));
    }
    if (not_done > 0) {
      notes.push_back(fmt::format("{}: not finished, so not compared: {} of {}", study.name,
                                  not_done, Counted(std::ssize(study.results.trials), "trial")));
    }
  }
  std::ranges::copy(AreaNotes(all), std::back_inserter(notes));
  return notes;
}

// Notes on means over different subjects, and on a correction that no result can pass.
std::vector<std::string> PairNotes(const StudyComparison& comparison) {
  constexpr double kSignificant = 0.05;
  std::vector<std::string> notes;
  const auto subjects = std::ssize(comparison.subjects);
  if (std::ranges::any_of(comparison.treatments,
                          [&](const ComparedTreatment& t) { return t.summary.n != subjects; })) {
    notes.emplace_back(
        "not all treatments have all subjects, so the means are over different subjects; compare "
        "the differences, which are over the subjects that both have");
  }
  const double least = std::pow(2.0, 1.0 - static_cast<double>(subjects)),
               corrected = least * static_cast<double>(comparison.pairs.size());
  if (subjects >= kMinComparedSubjects && corrected > kSignificant) {
    notes.push_back(fmt::format(
        "{} subjects cannot give a p below {:.2g}, so with Holm's correction for {} pairs the "
        "smallest possible p is {:.2g}; compare fewer treatments, or matched pairs alone "
        "(--pairs matched)",
        subjects, least, comparison.pairs.size(), std::min(1.0, corrected)));
  }
  return notes;
}

}  // namespace

std::vector<NamedStudy> ReadStudies(const std::vector<fs::path>& folders,
                                    const std::string& metric) {
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
  const std::vector<std::string> names = ShortNames(real);
  std::vector<NamedStudy> studies;
  for (std::size_t k = 0; k < real.size(); ++k) {
    studies.push_back(
        {names[k], ReadStudyResults(folders[k], TrialCheck::kSizes, metric), folders[k]});
    if (const std::string damaged = DamageText(studies.back().results); !damaged.empty()) {
      throw IoError(fmt::format("{}: {}", folders[k].string(), damaged));
    }
  }
  return studies;
}

Better CommonPreference(std::span<const NamedStudy* const> studies, const std::string& metric) {
  const NamedStudy* first = nullptr;
  const auto better = [](const NamedStudy* study) { return study->results.preference.better; };
  const auto word = [&](const NamedStudy* study) {
    return EnumNames(Better())[static_cast<std::size_t>(better(study))];
  };
  for (const NamedStudy* study : studies) {
    if (study->results.metric != metric) {
      continue;
    }
    if (first != nullptr && better(first) != better(study)) {
      throw InputError(
          fmt::format("'{}': {} values are better in {}, but {} values in {}; choose with --better",
                      metric, word(first), first->name, word(study), study->name));
    }
    first = study;
  }
  return first == nullptr ? DefaultBetter(metric) : better(first);
}

StudyComparison CompareStudies(std::span<const NamedStudy> studies, const CompareOptions& options) {
  const bool is_matched = options.pairs == ComparedPairs::kMatched;
  if (studies.empty() || (is_matched && studies.size() < 2)) {
    throw InputError(
        "one study alone has no matched pairs; give two folders or more, or compare all pairs");
  }
  const std::string metric =
      options.metric.empty() ? studies.front().results.metric : options.metric;
  std::vector<const NamedStudy*> each;
  for (const NamedStudy& study : studies) {
    each.push_back(&study);
  }
  const Better better = options.better ? *options.better : CommonPreference(each, metric);
  StudyComparison comparison{.metric = metric,
                             .preference = PreferenceFor(metric, better),
                             .studies = {},
                             .subjects = {},
                             .treatments = {},
                             .pairs = {},
                             .notes = {}};
  comparison.subjects = CommonSubjects(studies, metric);
  for (const NamedStudy& study : studies) {
    comparison.studies.push_back(study.name);
    std::ranges::move(ComparedTreatments(study, comparison),
                      std::back_inserter(comparison.treatments));
  }
  comparison.pairs = is_matched ? MatchedPairs(comparison) : AllPairs(comparison);
  AdjustTests(comparison.pairs);
  comparison.notes = PairNotes(comparison);
  std::ranges::move(ComparisonNotes(studies, metric, comparison.subjects),
                    std::back_inserter(comparison.notes));
  return comparison;
}

// ---------------------------------------------------------------------------------------------
// Rank agreement
// ---------------------------------------------------------------------------------------------

namespace {

using ValuesBySubject = std::map<std::string, double>;

std::map<std::string, ValuesBySubject> ByLabel(const NamedStudy& study, const std::string& metric) {
  std::map<std::string, ValuesBySubject> treatments;
  for (const Treatment& treatment : Treatments(study.results, metric)) {
    if (!treatment.by_subject.empty()) {
      treatments[treatment.label] = treatment.by_subject;
    }
  }
  return treatments;
}

// Means per treatment: of the metric, and of its cost (Preference).
struct TreatmentMeans {
  std::vector<double> value, cost;
};

// The means over the subjects that have all of the treatments.
TreatmentMeans ComputeMeans(const std::map<std::string, ValuesBySubject>& treatments,
                            const std::vector<std::string>& labels, const NamedStudy& study,
                            const Preference& preference) {
  std::map<std::string, std::size_t> have;
  for (const std::string& label : labels) {
    for (const auto& [subject, value] : treatments.at(label)) {
      ++have[subject];
    }
  }
  std::erase_if(have, [&](const auto& one) { return one.second < labels.size(); });
  if (have.empty()) {
    throw InputError(
        fmt::format("{}: no subject has all of the compared treatments; run the missing trials",
                    study.folder.string()));
  }
  TreatmentMeans means;
  for (const std::string& label : labels) {
    double sum = 0, cost = 0;
    for (const auto& [subject, count] : have) {
      sum += treatments.at(label).at(subject);
      cost += preference.RankingCost(treatments.at(label).at(subject));
    }
    means.value.push_back(sum / static_cast<double>(have.size()));
    means.cost.push_back(cost / static_cast<double>(have.size()));
  }
  return means;
}

}  // namespace

RankAgreement CompareRanks(const NamedStudy& reference, const NamedStudy& other,
                           const CompareOptions& options) {
  RankAgreement agreement{
      .metric = options.metric.empty() ? reference.results.metric : options.metric,
      .reference = reference.name,
      .study = other.name,
      .treatments = {}};
  const auto first = ByLabel(reference, agreement.metric),
             second = ByLabel(other, agreement.metric);
  std::vector<std::string> labels;
  for (const auto& [label, values] : first) {
    if (second.contains(label)) {
      labels.push_back(label);
    }
  }
  if (labels.size() < 3) {
    throw InputError(fmt::format(
        "{} and {} have too few treatments in common: {} with the number '{}'; comparing their "
        "order needs three",
        reference.folder.string(), other.folder.string(), labels.size(), agreement.metric));
  }
  agreement.preference = PreferenceFor(
      agreement.metric, options.better
                            ? *options.better
                            : CommonPreference(std::array{&reference, &other}, agreement.metric));
  const TreatmentMeans one = ComputeMeans(first, labels, reference, agreement.preference),
                       two = ComputeMeans(second, labels, other, agreement.preference);
  const std::vector<double> ranks_one = MeanRanks(one.cost), ranks_two = MeanRanks(two.cost);
  agreement.spearman = Spearman(one.cost, two.cost);
  for (std::size_t k = 0; k < labels.size(); ++k) {
    agreement.treatments.push_back(
        {labels[k], one.value[k], two.value[k], ranks_one[k], ranks_two[k]});
  }
  std::ranges::stable_sort(agreement.treatments, {}, &RankedTreatment::reference_rank);
  return agreement;
}

std::string RankText(const RankAgreement& agreement) {
  std::size_t width = 9;
  for (const RankedTreatment& t : agreement.treatments) {
    width = std::max(width, t.label.size());
  }
  std::string text = fmt::format(
      "{} in {} and in {}; {}\n{:<{}}  rank       mean  rank       mean\n", agreement.metric,
      agreement.reference, agreement.study, agreement.preference.ToPhrase(), "treatment", width);
  for (const RankedTreatment& t : agreement.treatments) {
    text += fmt::format("{:<{}} {:5.1f} {:10.4g} {:5.1f} {:10.4g}\n", t.label, width,
                        t.reference_rank, t.reference_mean, t.rank, t.mean);
  }
  return text + fmt::format("Spearman's rank correlation over {} treatments: {:.2f}\n",
                            agreement.treatments.size(), agreement.spearman);
}

}  // namespace semblance::problems
