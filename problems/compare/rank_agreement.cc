// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/compare/rank_agreement.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "problems/study/study_metrics.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

using BySubject = std::map<std::string, double>;

std::map<std::string, BySubject> ByLabel(const NamedStudy& study, const std::string& metric) {
  std::map<std::string, BySubject> treatments;
  for (const Treatment& treatment : Treatments(study.results, metric)) {
    if (!treatment.by_subject.empty()) {
      treatments[treatment.label] = treatment.by_subject;
    }
  }
  return treatments;
}

// Of the metric, and of what it costs.
struct MeansOfAll {
  std::vector<double> value, cost;
};

// Over the subjects that have all of the treatments.
MeansOfAll Means(const std::map<std::string, BySubject>& treatments,
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
        fmt::format("{}: no subject has all of the treatments that are compared; "
                    "run the trials that are missing",
                    study.folder.string()));
  }
  MeansOfAll means;
  for (const std::string& label : labels) {
    double sum = 0, cost = 0;
    for (const auto& [subject, count] : have) {
      sum += treatments.at(label).at(subject);
      cost += preference.CostOf(treatments.at(label).at(subject));
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
        "{} and {} have too few treatments in common: {} with the number '{}'; an "
        "order takes three",
        reference.folder.string(), other.folder.string(), labels.size(), agreement.metric));
  }
  agreement.preference =
      PreferenceFor(agreement.metric,
                    options.better ? *options.better
                                   : BetterIn(std::array{&reference, &other}, agreement.metric));
  const MeansOfAll one = Means(first, labels, reference, agreement.preference),
                   two = Means(second, labels, other, agreement.preference);
  const std::vector<double> of_one = MeanRanks(one.cost), of_two = MeanRanks(two.cost);
  agreement.spearman = Spearman(one.cost, two.cost);
  for (std::size_t k = 0; k < labels.size(); ++k) {
    agreement.treatments.push_back({labels[k], one.value[k], two.value[k], of_one[k], of_two[k]});
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
      "{} of {} and of {}; {}\n{:<{}}  rank       mean  rank       mean\n", agreement.metric,
      agreement.reference, agreement.study, agreement.preference.InWords(), "treatment", width);
  for (const RankedTreatment& t : agreement.treatments) {
    text += fmt::format("{:<{}} {:5.1f} {:10.4g} {:5.1f} {:10.4g}\n", t.label, width,
                        t.reference_rank, t.reference_mean, t.rank, t.mean);
  }
  return text + fmt::format("Spearman's rank correlation over {} treatments: {:.2f}\n",
                            agreement.treatments.size(), agreement.spearman);
}

}  // namespace semblance
