// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study_report/study_subtables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "problems/report/plain_names.h"

namespace semblance {
namespace {

// A column of a table: its head and the metric in it.
struct Column {
  std::string head, metric;
  int digits = 3;  // behind the point
};

// Over the trials of the treatment that are done, in the order of the plan; NaN for none.
double MeanOf(const StudyResults& results, const Treatment& treatment, const std::string& metric,
              double (*of)(double)) {
  double sum = 0;
  int count = 0;
  for (const std::size_t n : treatment.trials) {
    const auto& metrics = results.trials[n].metrics;
    if (const auto it = metrics.find(metric); it != metrics.end()) {
      sum += of(it->second);
      ++count;
    }
  }
  return count > 0 ? sum / count : kNaN;
}
double Itself(double x) { return x; }
double Square(double x) { return x * x; }

ReportTable TableOf(const StudyResults& results, const std::vector<Treatment>& ranked,
                    const std::string& caption, const std::vector<Column>& columns) {
  ReportTable table{caption, {"treatment"}, {}};
  const auto is_known = [&](const std::string& metric) {
    return std::ranges::any_of(results.trials,
                               [&](const TrialRow& row) { return row.metrics.contains(metric); });
  };
  for (const Treatment& treatment : ranked) {
    table.rows.push_back({treatment.label});
  }
  for (const Column& column : columns) {
    if (is_known(column.metric)) {
      table.header.push_back(column.head);
      for (std::size_t n = 0; n < ranked.size(); ++n) {
        table.rows[n].push_back(
            TableNumber(MeanOf(results, ranked[n], column.metric, Itself), column.digits));
      }
    }
  }
  if (table.header.size() == 1) {
    table.rows.clear();
  }
  return table;
}

std::string DifferenceText(const std::map<std::string, double>& values,
                           const std::map<std::string, double>& first) {
  double sum = 0;
  int pairs = 0, worse = 0;
  for (const auto& [subject, value] : values) {
    if (const auto it = first.find(subject); it != first.end()) {
      sum += value - it->second;
      ++pairs;
      worse += value > it->second;
    }
  }
  return pairs == 0 ? "" : fmt::format("{} ({} of {})", TableNumber(sum / pairs), worse, pairs);
}

// Names n of metrics `prefix`n`suffix`, sorted.
std::set<std::string> NamesBetween(const StudyResults& results, const std::string& prefix,
                                   const std::string& suffix) {
  std::set<std::string> names;
  for (const TrialRow& row : results.trials) {
    for (auto it = row.metrics.lower_bound(prefix);
         it != row.metrics.end() && it->first.starts_with(prefix); ++it) {
      const std::string rest = it->first.substr(prefix.size());
      const std::string name = rest.substr(0, rest.size() - std::min(rest.size(), suffix.size()));
      if (rest.ends_with(suffix) && name.find('.') == std::string::npos) {
        names.insert(name);
      }
    }
  }
  return names;
}

// Where not the lower values of the metric are better, its own columns are to be read so.
std::string Direction(const StudyResults& results) {
  return results.preference.better == Better::kLower ? "" : ", " + results.preference.InWords();
}

bool HigherIsBetter(const StudyResults& results) {
  return results.preference.better == Better::kHigher;
}

ReportTable SiblingsTable(const StudyResults& results, const std::vector<Treatment>& ranked,
                          const std::string& parent) {
  std::vector<Column> columns;
  if (HigherIsBetter(results)) {  // it is no error, and so none of the others
    columns.push_back({WordsOfMetric(results.metric) + Direction(results), results.metric});
  }
  for (const auto& [head, name] : std::to_array<std::pair<const char*, const char*>>(
           {{"RMS (mm)", "rms_mm"},
            {"mean (mm)", "mean_abs_mm"},
            {"median (mm)", "median_mm"},
            {"p95 (mm)", "p95_mm"},
            {"max (mm)", "max_mm"},
            {"signed mean (mm)", "mean_signed_mm"},
            {"within stated 90 %", "coverage_90"}})) {
    if (parent + name != results.metric || !HigherIsBetter(results)) {
      columns.push_back({head, parent + name});
    }
  }
  return TableOf(results, ranked,
                 HigherIsBetter(results)
                     ? "The metric and the error by other measures (lower is better), means over "
                       "subjects"
                     : "The same error by other measures, means over subjects",
                 columns);
}

ReportTable RegionsTable(const StudyResults& results, const std::vector<Treatment>& ranked,
                         const std::string& parent, const std::string& leaf) {
  std::vector<Column> columns;
  const std::string prefix = parent + "regions.", suffix = "." + leaf;
  for (const std::string& name : NamesBetween(results, prefix, suffix)) {
    columns.push_back({name, prefix + name + suffix});
  }
  return TableOf(results, ranked,
                 fmt::format("{} by part of the face, means over subjects{}", WordsOfMeasure(leaf),
                             Direction(results)),
                 columns);
}

constexpr const char* kTruthScores = "depth_truth.along_direction.scores.all.";
constexpr const char* kLeftOutScores = "cross_validation.landmark.scores.scheme.";
constexpr const char* kSideScores = "cross_validation.side.scores.scheme.";

ReportTable ScoresTable(const StudyResults& results, const std::vector<Treatment>& ranked,
                        const std::string& caption, const std::string& prefix) {
  std::vector<Column> columns;
  for (const auto& [head, name] : std::to_array<std::pair<const char*, const char*>>(
           {{"points", "n"},
            {"MAE (mm)", "mae_mm"},
            {"RMSE (mm)", "rmse_mm"},
            {"bias (mm)", "bias_mm"},
            {"stated sd (mm)", "mean_sd_mm"},
            {"CRPS (mm)", "crps_mm"},
            {"log score", "log_score"},
            {"interval score (mm)", "interval_score_90_mm"},
            {"within 50 %", "coverage_50"},
            {"within 90 %", "coverage_90"},
            {"within 95 %", "coverage_95"}})) {
    columns.push_back({head, prefix + name, std::string_view(name) == "n" ? 0 : 3});
  }
  if (std::ranges::any_of(results.trials, [&](const TrialRow& row) {
        const auto certain = row.metrics.find(prefix + "certain");
        return certain != row.metrics.end() && certain->second > 0;
      })) {  // whose log score is infinite, and in no mean
    columns.push_back({"stated as certain", prefix + "certain", 1});
  }
  return TableOf(results, ranked, caption, columns);
}

// Each treatment's score less that of the first, over the subjects that both have.
ReportTable PairedScoresTable(const StudyResults& results, const std::vector<Treatment>& ranked) {
  ReportTable table{"", {"treatment"}, {}};
  if (ranked.size() < 2) {
    return table;
  }
  table.caption = fmt::format(
      "Scores less those of {}, paired by subject: mean difference (worse "
      "in how many subjects)",
      ranked[0].label);
  for (const Treatment& treatment : ranked) {
    table.rows.push_back({treatment.label});
  }
  for (const auto& [head, metric] : std::to_array<std::pair<const char*, std::string>>(
           {{"true depth: CRPS (mm)", fmt::format("{}crps_mm", kTruthScores)},
            {"true depth: log score", fmt::format("{}log_score", kTruthScores)},
            {"true depth: interval (mm)", fmt::format("{}interval_score_90_mm", kTruthScores)},
            {"landmarks: CRPS (mm)", fmt::format("{}crps_mm", kLeftOutScores)},
            {"landmarks: log score", fmt::format("{}log_score", kLeftOutScores)}})) {
    const auto treatments = Treatments(results, metric);
    const auto of = [&](const Treatment& t) {
      return std::ranges::find(treatments, t.values, &Treatment::values)->by_subject;
    };
    const auto first = of(ranked[0]);
    if (first.empty()) {
      continue;
    }
    table.header.emplace_back(head);
    for (std::size_t n = 0; n < ranked.size(); ++n) {
      table.rows[n].push_back(DifferenceText(of(ranked[n]), first));
    }
  }
  if (table.header.size() == 1) {
    table.rows.clear();
  }
  return table;
}

ReportTable LeftOutTable(const StudyResults& results, const std::vector<Treatment>& ranked) {
  std::vector<Column> columns;
  for (const auto& [kind, words] : std::to_array<std::pair<const char*, const char*>>(
           {{"landmark", "a landmark"}, {"side", "a side"}, {"k_fold", "a random part"}})) {
    columns.push_back(
        {fmt::format("{}: RMS (mm)", words), fmt::format("cross_validation.{}.rms_mm", kind)});
    columns.push_back({fmt::format("{}: within 90 %", words),
                       fmt::format("cross_validation.{}.coverage_90", kind)});
  }
  return TableOf(results, ranked, "Dowels left out and predicted, means over subjects", columns);
}

// Of treatments that average schemes, what each counts.
ReportTable SharesTable(const StudyResults& results, const std::vector<Treatment>& ranked) {
  const std::string prefix = "depth.shares.";
  std::vector<Column> columns;
  for (const std::string& name : NamesBetween(results, prefix, "")) {
    columns.push_back({name, prefix + name});
  }
  ReportTable table = TableOf(
      results, ranked, "Weights of the schemes that are averaged, means over subjects", columns);
  std::erase_if(table.rows, [](const std::vector<std::string>& row) {
    return std::all_of(row.begin() + 1, row.end(),
                       [](const std::string& cell) { return cell.empty(); });
  });
  return table;
}

ReportTable SitesTable(const StudyResults& results, const std::vector<Treatment>& ranked) {
  const std::string prefix = "cross_validation.landmark.sites.";
  ReportTable table{
      "RMS error (mm) of each dowel when its landmark is left out, over subjects", {"site"}, {}};
  for (const Treatment& treatment : ranked) {
    table.header.push_back(treatment.label);
  }
  for (const std::string& site : NamesBetween(results, prefix, "")) {
    std::vector<std::string> row = {site};
    for (const Treatment& treatment : ranked) {
      row.push_back(TableNumber(std::sqrt(MeanOf(results, treatment, prefix + site, Square))));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

std::vector<ReportTable> Subtables(const StudyResults& results,
                                   const std::vector<Treatment>& ranked) {
  const std::size_t dot = results.metric.rfind('.');
  const std::string parent = dot == std::string::npos ? "" : results.metric.substr(0, dot + 1);
  const std::string leaf = results.metric.substr(parent.size());
  std::vector<ReportTable> tables = {SiblingsTable(results, ranked, parent),
                                     RegionsTable(results, ranked, parent, leaf),
                                     LeftOutTable(results, ranked), SitesTable(results, ranked)};
  const auto scores = [&](const std::string& of_what, const char* prefix) {
    tables.push_back(ScoresTable(
        results, ranked,
        fmt::format("Proper scores of {}, means over subjects; smaller is better", of_what),
        prefix));
  };
  scores("the depth against the true one", kTruthScores);
  scores("landmarks left out, where the scheme itself answers", kLeftOutScores);
  scores("a side left out, where the scheme itself answers", kSideScores);
  tables.push_back(PairedScoresTable(results, ranked));
  tables.push_back(SharesTable(results, ranked));
  std::erase_if(tables, [](const ReportTable& table) { return table.rows.empty(); });
  return tables;
}

}  // namespace semblance
