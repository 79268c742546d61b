// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/comparison_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "problems/report/plain_names.h"
#include "problems/report/report_kit.h"
#include "surfaces/base/csv.h"

namespace semblance::problems {
namespace {

std::string FullLabel(const ComparedTreatment& treatment) {
  return fmt::format("{}: {}", treatment.study, treatment.label);
}

std::string Direction(const StudyComparison& comparison) {
  return comparison.preference.ToPhrase();
}

ReportTable TreatmentTable(const StudyComparison& comparison) {
  ReportTable table{
      fmt::format("{} over {} that all studies have; {}", WordsOfMetric(comparison.metric),
                  Counted(std::ssize(comparison.subjects), "subject"), Direction(comparison)),
      {"study", "treatment", "subjects", "mean", "sd", "95 % of the mean"}};
  for (const ComparedTreatment& t : comparison.treatments) {
    table.AddRow(t.study, t.label, t.summary.n, t.summary.mean, t.summary.sd,
                 IntervalText(t.summary.mean_95));
  }
  return table;
}

ReportTable PairTable(const StudyComparison& comparison) {
  ReportTable table{"Each treatment minus its reference, over the subjects that both have" +
                        comparison.preference.TargetSuffix(),
                    {"treatment", "reference", "subjects", "mean difference", "95 % interval",
                     "worse in", "p, Holm"}};
  for (const TreatmentPair& pair : comparison.pairs) {
    table.AddRow(FullLabel(pair.other), FullLabel(pair.reference), pair.difference.n,
                 pair.difference.mean, IntervalText(pair.difference.mean_95),
                 fmt::format("{} of {}", pair.worse, pair.difference.n), pair.p_holm);
  }
  return table;
}

ReportImage MetricBoxes(const StudyComparison& comparison) {
  std::vector<BoxRow> rows;
  for (const ComparedTreatment& treatment : comparison.treatments) {
    BoxRow row{FullLabel(treatment), {}, {}};
    for (const auto& [subject, value] : treatment.by_subject) {
      row.values.push_back(value);
      row.names.push_back(subject);
    }
    rows.push_back(std::move(row));
  }
  return SubjectBoxPlot(rows, WordsOfMetric(comparison.metric),
                        "box plot of the metric, one row per treatment of each study");
}

Report MakeReport(const StudyComparison& comparison) {
  constexpr std::size_t kMostShown = 12;  // pairs; a longer table is folded
  Report report{
      .title = fmt::format("{} compared", fmt::join(comparison.studies, ", ")),
      .subtitle = fmt::format("{}, paired by subject; {}", WordsOfMetric(comparison.metric),
                              Direction(comparison)),
      .notes = comparison.notes,
      .main_images = {MetricBoxes(comparison)},
  };
  report.sections.push_back(
      {.heading = "Differences",
       .paragraphs = {fmt::format(
           "p comes from Wilcoxon's signed-rank test, which needs six subjects. Holm's correction "
           "is for the {} of this table.",
           Counted(std::ssize(comparison.pairs), "pair"))},
       .tables = {PairTable(comparison)},
       .folded = comparison.pairs.size() > kMostShown});
  report.sections.push_back({.heading = "Treatments", .tables = {TreatmentTable(comparison)}});
  return report;
}

std::string PairText(const TreatmentPair& pair) {
  const std::string names =
      fmt::format("{} minus {}", FullLabel(pair.other), FullLabel(pair.reference));
  if (pair.difference.n == 0) {
    return fmt::format("{}: no subject was done with both\n", names);
  }
  const std::string interval = IntervalText(pair.difference.mean_95);
  return fmt::format("{}: {:+.3f}{}, better for {} and worse for {} of {} subjects{}\n", names,
                     pair.difference.mean, interval.empty() ? "" : fmt::format(" ({})", interval),
                     pair.better, pair.worse, pair.difference.n,
                     std::isfinite(pair.p_holm) ? fmt::format(", p = {:.3g}", pair.p_holm) : "");
}

}  // namespace

std::string ComparisonText(const StudyComparison& comparison) {
  constexpr std::size_t kMostLines = 20;
  std::string text =
      fmt::format("{} over {}; {}\n", comparison.metric,
                  Counted(std::ssize(comparison.subjects), "subject"), Direction(comparison));
  for (const ComparedTreatment& t : comparison.treatments) {
    const auto subjects = std::ssize(comparison.subjects);
    text += fmt::format("  {}: {}{}\n", FullLabel(t), TableNumber(t.summary.mean),
                        t.summary.n == subjects
                            ? ""
                            : fmt::format(" (over {} of {} subjects)", t.summary.n, subjects));
  }
  for (std::size_t n = 0; n < std::min(comparison.pairs.size(), kMostLines); ++n) {
    text += PairText(comparison.pairs[n]);
  }
  if (comparison.pairs.size() > kMostLines) {
    text += fmt::format("and {} more pairs; --out DIR writes all of them to pairs.csv\n",
                        comparison.pairs.size() - kMostLines);
  }
  for (const std::string& note : comparison.notes) {
    text += fmt::format("note: {}\n", note);
  }
  return text;
}

std::string PairsCsv(const StudyComparison& comparison) {
  CsvWriter csv({"study", "treatment", "reference_study", "reference", "subjects",
                 "mean_difference", "mean_low_95", "mean_high_95", "better", "worse", "p",
                 "p_holm"});
  for (const TreatmentPair& p : comparison.pairs) {
    csv.Row(p.other.study, p.other.label, p.reference.study, p.reference.label, p.difference.n,
            p.difference.mean, p.difference.mean_95.low, p.difference.mean_95.high, p.better,
            p.worse, p.test.p, p.p_holm);
  }
  return csv.Text();
}

std::string ComparedCsv(const StudyComparison& comparison) {
  CsvWriter csv({"study", "treatment", "subject", "metric", "value"});
  for (const ComparedTreatment& treatment : comparison.treatments) {
    for (const auto& [subject, value] : treatment.by_subject) {
      csv.Row(treatment.study, treatment.label, subject, comparison.metric, value);
    }
  }
  return csv.Text();
}

void WriteComparison(const StudyComparison& comparison, OutputFolder& folder) {
  folder.Write("pairs.csv", PairsCsv(comparison));
  folder.Write("values.csv", ComparedCsv(comparison));
  folder.Write("report.html", ReportHtml(MakeReport(comparison)));
}

}  // namespace semblance::problems
