// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/base/parallel.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Moves the lists that reports draw as curves.
void TakeCurves(std::map<std::string, std::vector<double>>& lists, TrialRow& row) {
  row.quantiles_mm = std::move(lists["face.quantiles_mm"]);
  row.depth_coverage = std::move(lists["depth_truth.along_direction.coverage"]);
  row.left_out_coverage = std::move(lists["cross_validation.landmark.coverage"]);
  row.depth_pit = std::move(lists["depth_truth.along_direction.scores.all.pit"]);
  row.left_out_pit = std::move(lists["cross_validation.landmark.scores.scheme.pit"]);
  const std::vector<double>& before = lists["fit.levels.rms_before_mm"];
  row.step_rms_mm = std::move(lists["fit.levels.rms_after_mm"]);
  if (!before.empty()) {
    row.step_rms_mm.insert(row.step_rms_mm.begin(), before.front());
  }
}

// Returns NaN if the file is missing or lacks the time.
double ReadWallTime_s(const fs::path& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    return kNaN;
  }
  const Json json = Json::parse(ReadFileBytes(file), nullptr, /*allow_exceptions=*/false);
  return json.is_object() && json.contains("total_wall_s") && json["total_wall_s"].is_number()
             ? json["total_wall_s"].get<double>()
             : kNaN;
}

std::string NameOtherMaker(const TrialNumbers& trial) {
  return IsOfThisProgram(trial)               ? ""
         : trial.version.empty()              ? "an unknown version"
         : trial.version == SEMBLANCE_VERSION ? "another build of version " + trial.version
                                              : "version " + trial.version;
}

void ReadTrial(const fs::path& folder, TrialCheck check, SharedNames& names, TrialRow& row) {
  StoredTrial stored = ReadTrial(folder, row.id, check, names);
  row.status = stored.fault.empty() ? "missing" : "damaged";
  row.reason = std::move(stored.fault);
  if (!stored.numbers) {
    return;
  }
  TrialNumbers& trial = *stored.numbers;
  row.made_by_other = NameOtherMaker(trial);
  row.status = std::move(trial.status);
  row.reason = std::move(trial.reason);
  row.wall_s = ReadWallTime_s(TrialFolder(folder, row.id) / "timing.json");
  row.metrics = std::move(trial.metrics);
  TakeCurves(trial.lists, row);
}

// The part of a number's path before its last dot; empty without a dot.
std::string_view FindGroup(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  return name.substr(0, dot == name.npos ? 0 : dot);
}

// The numbers that a study keeps of each trial; see kMostTrialsInFull.
SharedNames::Filter MakeFilter(std::size_t trials, const std::vector<std::string>& metrics) {
  if (trials <= kMostTrialsInFull) {
    return {};
  }
  std::set<std::string, std::less<>> groups;
  for (const std::string& metric : metrics) {
    for (const std::string& operand : ListOperands(metric)) {
      groups.emplace(FindGroup(operand));
    }
  }
  return [groups](std::string_view name) { return groups.contains(FindGroup(name)); };
}

// Reads all trials in parallel: a study has many, and reading them takes most of the time of its
// tables.
void ReadTrials(const fs::path& folder, TrialCheck check, SharedNames& names,
                std::vector<TrialRow>& rows) {
  constexpr std::size_t kBlock = 4;  // trials per task
  ParallelFor(rows.size(), static_cast<int>(std::max(1U, std::thread::hardware_concurrency())),
              kBlock, [&](std::size_t n) { ReadTrial(folder, check, names, rows[n]); });
}

std::map<std::string, double> BySubject(const StudyResults& results, const Treatment& treatment,
                                        const std::string& metric) {
  std::map<std::string, double> values;
  for (const std::size_t n : treatment.trials) {
    const TrialRow& row = results.trials[n];
    if (const auto value = row.metrics.find(metric); value != row.metrics.end()) {
      values[row.subject] = value->second;
    }
  }
  return values;
}

// Collects the names of all metrics of all trials, sorted.
std::set<std::string> CollectMetrics(const StudyResults& results) {
  std::set<std::string> metrics;
  std::set<const std::vector<std::string>*> seen = {nullptr};  // most trials share their names
  for (const TrialRow& row : results.trials) {
    if (seen.insert(row.metrics.names()).second) {
      metrics.insert(row.metrics.names()->begin(), row.metrics.names()->end());
    }
  }
  return metrics;
}

// Finds the area that the study's metric is taken over: the closest `area_cm2` above it in the
// path.
std::string FindAreaMetric(const StudyResults& results) {
  const std::set<std::string> known = CollectMetrics(results);
  std::string group = results.metric;
  while (group.find('.') != group.npos) {
    group = group.substr(0, group.rfind('.'));
    if (known.contains(group + ".area_cm2")) {
      return group + ".area_cm2";
    }
  }
  return "";
}

// Adds the study's metric to the numbers of each trial if it is an expression over them.
void AddExpression(StudyResults& results) {
  if (!IsExpression(results.metric)) {
    return;
  }
  for (TrialRow& row : results.trials) {
    const double value = ComputeMetric(row.metrics, results.metric);
    if (std::isfinite(value)) {
      row.metrics[results.metric] = value;
    }
  }
}

// Makes a row from the plan. Its numbers are read later.
TrialRow MakeRow(const Json& trial) {
  TrialRow row;
  row.id = trial.at("id");
  row.subject = trial.at("subject");
  row.values = trial.at("values").get<std::vector<std::string>>();
  return row;
}

}  // namespace

int StudyResults::Count(const std::string& status) const {
  return static_cast<int>(std::count_if(trials.begin(), trials.end(),
                                        [&](const TrialRow& row) { return row.status == status; }));
}

bool StudyResults::HasMetric() const {
  return std::ranges::any_of(trials, [&](const TrialRow& row) {
    return row.status == "done" && row.metrics.contains(metric);
  });
}

StudyResults ReadStudyRows(const fs::path& folder) {
  const fs::path file = folder / "plan.json";
  const auto fail = [&file] {
    return IoError(fmt::format(
        "{}: not the plan of a study, or cut short; run the study again to write it again",
        file.string()));
  };
  StudyResults results;
  try {
    const Json plan = ParseJson(ReadFileBytes(file), file.string());
    results.title = plan.at("title");
    results.hash = plan.at("hash");
    results.metric = plan.at("metric");
    results.axes = plan.at("axes").get<std::vector<std::string>>();
    results.notes = plan.at("notes").get<std::vector<std::string>>();
    for (const Json& trial : plan.at("trials")) {
      results.trials.push_back(MakeRow(trial));
      if (results.trials.back().values.size() != results.axes.size()) {
        throw fail();
      }
    }
    results.tags = plan.value("tags", std::vector<std::string>());
    results.preference = PreferenceFor(results.metric);
  } catch (const nlohmann::json::exception&) {
    throw fail();
  }
  return results;
}

StudyResults ReadStudyResults(const fs::path& folder, TrialCheck check,
                              const std::string& further) {
  StudyResults results = ReadStudyRows(folder);
  SharedNames names(MakeFilter(results.trials.size(),
                               {results.metric, further.empty() ? results.metric : further}));
  ReadTrials(folder, check, names, results.trials);
  AddExpression(results);
  if (results.trials.size() > kMostTrialsInFull) {
    results.notes.push_back(fmt::format(
        "the study has more than {} trials, so its tables hold the numbers beside the metric alone "
        "(of the group {}); trial.json of each trial has all",
        kMostTrialsInFull, FindGroup(ListOperands(results.metric).front())));
  }
  std::ranges::copy(VersionNotes(results), std::back_inserter(results.notes));
  std::ranges::copy(AreaNotes(results), std::back_inserter(results.notes));
  if (!results.tags.empty()) {
    results.notes.push_back(fmt::format("tags: {}", fmt::join(results.tags, ", ")));
  }
  return results;
}

std::vector<std::string> VersionNotes(const StudyResults& results) {
  std::map<std::string, int> count;
  for (const TrialRow& row : results.trials) {
    if (!row.made_by_other.empty()) {
      ++count[row.made_by_other];
    }
  }
  std::vector<std::string> notes;
  for (const auto& [maker, trials] : count) {
    notes.push_back(fmt::format(
        "{} of {} trials {} made by {}, and this program is version {}; their numbers may differ "
        "for this reason. `semblance study CONFIG --rerun other-versions` makes them again",
        trials, results.trials.size(), trials == 1 ? "was" : "were", maker, SEMBLANCE_VERSION));
  }
  return notes;
}

std::string MissingMetricText(const StudyResults& results) {
  constexpr std::size_t kNamed = 5;
  if (!results.HasMetric()) {
    return results.Count("done") == 0
               ? ""
               : fmt::format("no trial has the number '{}'; trials.csv lists all numbers",
                             results.metric);
  }
  std::vector<std::string> named;
  std::size_t count = 0;
  for (const TrialRow& row : results.trials) {
    if (row.status == "done" && !row.metrics.contains(results.metric) && ++count <= kNamed) {
      named.push_back(fmt::format("{} {}", row.subject, fmt::join(row.values, " | ")));
    }
  }
  return count == 0 ? ""
                    : fmt::format(
                          "{} of {} trials that are done {} no finite number '{}' and "
                          "{} not count: {}{}",
                          count, results.Count("done"), count == 1 ? "has" : "have", results.metric,
                          count == 1 ? "does" : "do", fmt::join(named, "; "),
                          count > kNamed ? "; ..." : "");
}

std::string DamageText(const StudyResults& results) {
  constexpr std::size_t kNamed = 5;
  std::vector<std::string> named;
  for (const TrialRow& row : results.trials) {
    if (row.status == "damaged" && named.size() < kNamed) {
      named.push_back(fmt::format("trials/{}: {}", row.id, row.reason));
    }
  }
  const auto count = static_cast<std::size_t>(results.Count("damaged"));
  return named.empty() ? ""
                       : fmt::format(
                             "{} of {} trials {} damaged and left out; run the study again, "
                             "which makes {} again: {}{}",
                             count, results.trials.size(), count == 1 ? "is" : "are",
                             count == 1 ? "it" : "them", fmt::join(named, "; "),
                             count > kNamed ? "; ..." : "");
}

std::vector<std::string> AreaNotes(const StudyResults& results) {
  constexpr double kTolerance = 0.005;  // relative; a smaller one warns of smaller differences
  const std::string metric = FindAreaMetric(results);
  std::map<std::string, std::pair<double, double>> range_cm2;  // by subject: least and most
  for (const TrialRow& row : results.trials) {
    const auto area = row.metrics.find(metric);
    if (row.status == "done" && area != row.metrics.end()) {
      auto& [least, most] =
          range_cm2.try_emplace(row.subject, area->second, area->second).first->second;
      least = std::min(least, area->second);
      most = std::max(most, area->second);
    }
  }
  std::vector<std::string> changed;
  for (const auto& [subject, range] : range_cm2) {
    if (range.second - range.first > kTolerance * range.second) {
      changed.push_back(fmt::format("{} ({:.1f} to {:.1f})", subject, range.first, range.second));
    }
  }
  if (changed.empty()) {
    return {};
  }
  return {fmt::format(
      "the treatments were not measured on the same area ({}, cm²): {}. Their numbers cannot be "
      "compared; use the same options for what is measured (region, network) in all treatments",
      metric, fmt::join(changed, ", "))};
}

std::string TreatmentLabel(const std::vector<std::string>& axes,
                           const std::vector<std::string>& values) {
  std::string label;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (axes[k] == "title" && !values[k].empty()) {
      return values[k];
    }
    label += label.empty() || values[k].empty() ? values[k] : ", " + values[k];
  }
  return label.empty() ? "base" : label;
}

std::vector<Treatment> Treatments(const StudyResults& results, const std::string& metric) {
  std::vector<Treatment> treatments;
  std::map<std::vector<std::string>, std::size_t> index;
  for (std::size_t n = 0; n < results.trials.size(); ++n) {
    const TrialRow& row = results.trials[n];
    const auto [it, is_new] = index.try_emplace(row.values, treatments.size());
    if (is_new) {
      treatments.push_back({row.values, TreatmentLabel(results.axes, row.values), {}, {}});
    }
    if (row.status == "done") {
      treatments[it->second].trials.push_back(n);
    }
    treatments[it->second].unusable += row.status == "unusable" ? 1 : 0;
  }
  for (Treatment& treatment : treatments) {
    treatment.by_subject = BySubject(results, treatment, metric);
  }
  return treatments;
}

std::string UnusableText(const StudyResults& results) {
  std::string by_treatment;
  for (const Treatment& treatment : Treatments(results, results.metric)) {
    if (treatment.unusable > 0) {
      by_treatment += fmt::format("{}{} ({})", by_treatment.empty() ? "" : "; ", treatment.label,
                                  treatment.unusable);
    }
  }
  return by_treatment.empty()
             ? ""
             : fmt::format(
                   "{} of {} trials not usable and left out of rankings, means and tests: "
                   "{}. The table of trials has the reasons",
                   results.Count("unusable"), results.trials.size(), by_treatment);
}

std::string TrialsCsv(const StudyResults& results) {
  std::vector<std::string> columns = {"trial", "subject"};
  columns.insert(columns.end(), results.axes.begin(), results.axes.end());
  columns.insert(columns.end(), {"status", "reason", "metric", "value"});
  CsvWriter csv(columns);
  for (const TrialRow& row : results.trials) {
    if (row.metrics.empty()) {
      csv.Row(row.id, row.subject, row.values, row.status, row.reason, "", "");
    }
    for (const auto& [metric, value] : row.metrics) {
      csv.Row(row.id, row.subject, row.values, row.status, row.reason, metric, value);
    }
  }
  return csv.Text();
}

std::string TrialsWideCsv(const StudyResults& results) {
  const std::set<std::string> metrics = CollectMetrics(results);
  std::vector<std::string> columns = {"trial", "subject"};
  columns.insert(columns.end(), results.axes.begin(), results.axes.end());
  columns.insert(columns.end(), {"status", "reason"});
  columns.insert(columns.end(), metrics.begin(), metrics.end());
  CsvWriter csv(columns);
  for (const TrialRow& row : results.trials) {
    csv.Add(row.id, row.subject, row.values, row.status, row.reason);
    auto next = row.metrics.begin();  // both are in the order of the names
    for (const std::string& metric : metrics) {
      const bool has = next != row.metrics.end() && next->first == metric;
      csv.Add(has ? (next++)->second : kNaN);
    }
    csv.EndRow();
  }
  return csv.Text();
}

namespace {

// Walks through the metrics in the order of their names, for all trials at once. One pass is much
// faster than to look up each value of a trial.
class MetricWalk {
 public:
  explicit MetricWalk(const StudyResults& results) : results_(results) {
    for (const TrialRow& row : results.trials) {
      next_.push_back(row.metrics.begin());
    }
  }

  // Does what BySubject does. Metrics must be requested in ascending order for each trial.
  std::map<std::string, double> Next(const Treatment& treatment, const std::string& metric) {
    std::map<std::string, double> values;
    for (const std::size_t n : treatment.trials) {
      const TrialRow& row = results_.trials[n];
      if (next_[n] != row.metrics.end() && next_[n]->first == metric) {
        values[row.subject] = next_[n]->second;
        ++next_[n];
      }
    }
    return values;
  }

 private:
  const StudyResults& results_;
  std::vector<NamedNumbers::Iterator> next_;  // per trial
};

}  // namespace

namespace {

// The subjects that each treatment with any value has.
std::set<std::string> FindCommon(const std::vector<std::map<std::string, double>>& by_subject) {
  std::map<std::string, std::size_t> count;
  std::size_t treatments = 0;
  for (const auto& values : by_subject) {
    treatments += values.empty() ? 0 : 1;
    for (const auto& [subject, value] : values) {
      ++count[subject];
    }
  }
  std::set<std::string> common;
  for (const auto& [subject, times] : count) {
    if (times == treatments) {
      common.insert(subject);
    }
  }
  return common;
}

// Bootstraps take most of the time of the tables, so that threads share them.
std::vector<SampleSummary> SummarizeEach(
    const std::vector<std::map<std::string, double>>& by_subject) {
  constexpr std::size_t kBlock = 8;  // summaries per task
  std::vector<SampleSummary> summaries(by_subject.size());
  ParallelFor(by_subject.size(),
              static_cast<int>(std::max(1U, std::thread::hardware_concurrency())), kBlock,
              [&](std::size_t n) {
                std::vector<double> values;
                for (const auto& [subject, value] : by_subject[n]) {
                  values.push_back(value);
                }
                summaries[n] = Summarize(values);
              });
  return summaries;
}

double MeanOver(const std::map<std::string, double>& values,
                const std::set<std::string>& subjects) {
  double sum = 0;
  int count = 0;
  for (const auto& [subject, value] : values) {
    sum += subjects.contains(subject) ? value : 0;
    count += subjects.contains(subject) ? 1 : 0;
  }
  return count > 0 ? sum / count : kNaN;
}

}  // namespace

std::string SummaryCsv(const StudyResults& results) {
  std::vector<std::string> columns = results.axes;
  columns.insert(columns.end(), {"metric", "n", "mean", "sd", "median", "min", "max", "mean_low_95",
                                 "mean_high_95", "unusable", "n_common", "mean_common"});
  CsvWriter csv(columns);
  const std::vector<Treatment> treatments = Treatments(results, results.metric);
  MetricWalk walk(results);
  for (const std::string& metric : CollectMetrics(results)) {
    std::vector<std::map<std::string, double>> by_subject;
    for (const Treatment& treatment : treatments) {
      by_subject.push_back(walk.Next(treatment, metric));
    }
    const std::set<std::string> common = FindCommon(by_subject);
    const std::vector<SampleSummary> summaries = SummarizeEach(by_subject);
    for (std::size_t n = 0; n < treatments.size(); ++n) {
      const SampleSummary& s = summaries[n];
      csv.Row(treatments[n].values, metric, s.n, s.mean, s.sd, s.median, s.min, s.max,
              s.mean_95.low, s.mean_95.high, treatments[n].unusable, common.size(),
              MeanOver(by_subject[n], common));
    }
  }
  return csv.Text();
}

}  // namespace semblance::problems
