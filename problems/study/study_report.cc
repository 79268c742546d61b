// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "problems/report/report.h"
#include "problems/report/scene_json.h"
#include "problems/report/svg_plot.h"
#include "problems/study/identify_report.h"
#include "problems/study/results_sqlite.h"
#include "problems/study/study_subtables.h"

namespace semblance {
namespace {

constexpr std::size_t kMostScenes = 40;  // in one list to choose from
constexpr int kLeastSubjects = 6;        // two-sided, five subjects cannot reach p < 0.05

std::string IntervalText(const Interval& interval) {
  return std::isfinite(interval.low) ? fmt::format("{:.3f} to {:.3f}", interval.low, interval.high)
                                     : "";
}

std::vector<double> ValuesOf(const Treatment& treatment) {
  std::vector<double> values;
  for (const auto& [subject, value] : treatment.by_subject) {
    values.push_back(value);
  }
  return values;
}

double MeanOver(const std::map<std::string, double>& by_subject) {
  double sum = 0;
  for (const auto& [subject, value] : by_subject) {
    sum += value;
  }
  return by_subject.empty() ? kNaN : sum / static_cast<double>(by_subject.size());
}

// Best mean first; those without values last.
std::vector<Treatment> Ranked(std::vector<Treatment> treatments) {
  std::ranges::stable_sort(treatments, [](const Treatment& a, const Treatment& b) {
    const double x = MeanOver(a.by_subject), y = MeanOver(b.by_subject);
    return std::isfinite(x) && (!std::isfinite(y) || x < y);
  });
  return treatments;
}

ReportTable RankingTable(const std::vector<Treatment>& ranked, const std::string& metric) {
  ReportTable table{
      fmt::format("Treatments by {}, best mean first", metric),
      {"treatment", "subjects", "mean", "mean, 95 % interval", "sd", "median", "min", "max"},
      {}};
  for (const Treatment& treatment : ranked) {
    const SampleSummary s = Summarize(ValuesOf(treatment));
    table.rows.push_back({treatment.label, std::to_string(s.n), TableNumber(s.mean),
                          IntervalText(s.mean_95), TableNumber(s.sd), TableNumber(s.median),
                          TableNumber(s.min), TableNumber(s.max)});
  }
  return table;
}

std::vector<double> Differences(const Treatment& treatment, const Treatment& best) {
  std::vector<double> differences;
  for (const auto& [subject, value] : treatment.by_subject) {
    if (const auto other = best.by_subject.find(subject); other != best.by_subject.end()) {
      differences.push_back(value - other->second);
    }
  }
  return differences;
}

ReportTable PairsTable(const std::vector<Treatment>& ranked) {
  ReportTable table{
      fmt::format("Each treatment less the best ({}), paired by subject", ranked[0].label),
      {"treatment", "pairs", "mean difference", "95 % interval", "worse in", "Wilcoxon p",
       "p, Holm"},
      {}};
  std::vector<double> p;
  for (std::size_t n = 1; n < ranked.size(); ++n) {
    const std::vector<double> d = Differences(ranked[n], ranked[0]);
    const SampleSummary s = Summarize(d);
    const WilcoxonResult w = Wilcoxon(d);
    const bool enough = s.n >= kLeastSubjects && std::isfinite(w.p);
    p.push_back(enough ? w.p : 1);
    const auto worse = std::count_if(d.begin(), d.end(), [](double x) { return x > 0; });
    table.rows.push_back({ranked[n].label, std::to_string(s.n), TableNumber(s.mean),
                          IntervalText(s.mean_95), fmt::format("{} of {}", worse, s.n),
                          enough ? fmt::format("{:.4f}{}", w.p, w.exact ? "" : " (normal)") : "",
                          enough ? "?" : ""});
  }
  const std::vector<double> adjusted = Holm(p);
  for (std::size_t n = 0; n < table.rows.size(); ++n) {
    std::string& cell = table.rows[n].back();
    cell = cell.empty() ? "" : fmt::format("{:.4f}", adjusted[n]);
  }
  return table;
}

// The subjects that all treatments have, as a table for Friedman's test.
std::vector<std::vector<double>> CompleteTable(const std::vector<Treatment>& treatments) {
  std::vector<std::vector<double>> rows;
  for (const auto& [subject, value] : treatments[0].by_subject) {
    std::vector<double> row;
    for (const Treatment& treatment : treatments) {
      if (const auto it = treatment.by_subject.find(subject); it != treatment.by_subject.end()) {
        row.push_back(it->second);
      }
    }
    if (row.size() == treatments.size()) {
      rows.push_back(row);
    }
  }
  return rows;
}

// Of two treatments or more.
ReportSection RankSection(const std::vector<Treatment>& ranked) {
  ReportSection section{.heading = "Do the treatments differ?"};
  const auto rows = CompleteTable(ranked);
  if (static_cast<int>(rows.size()) < kLeastSubjects) {
    section.paragraphs = {fmt::format(
        "{} subjects have a value for all {} treatments. That is too few for a test: at least {} "
        "subjects are needed. The differences above stand for themselves.",
        rows.size(), ranked.size(), kLeastSubjects)};
    return section;
  }
  const FriedmanResult f = Friedman(rows);
  std::vector<RankedLabel> labels;
  for (std::size_t n = 0; n < ranked.size(); ++n) {
    labels.push_back({ranked[n].label, f.mean_ranks[n]});
  }
  section.images = {
      {RankPlotSvg(labels, f.critical_difference),
       "Ranks within each subject, averaged. Treatments that a grey line joins cannot "
       "be told apart at 5 % (Nemenyi).",
       "mean ranks of the treatments with the critical difference"}};
  section.paragraphs = {fmt::format(
      "Over {} subjects and {} treatments: Friedman's chi-square is {:.3f}; in Iman and "
      "Davenport's form F = {:.3f}, p = {:.2g}.",
      f.subjects, f.treatments, f.chi2, f.f, f.p)};
  return section;
}

ReportSection TrialsSection(const StudyResults& results) {
  ReportSection section{.heading = "Trials"};
  section.paragraphs = results.notes;
  ReportTable table{fmt::format("Every trial, with {}", results.metric),
                    {"trial", "subject", "treatment", "status", "value", "reason"},
                    {}};
  for (const TrialRow& row : results.trials) {
    const auto value = row.metrics.find(results.metric);
    table.rows.push_back({row.id, row.subject, TreatmentLabel(results.axes, row.values), row.status,
                          value == row.metrics.end() ? "" : TableNumber(value->second),
                          row.reason});
  }
  section.tables = {table};
  return section;
}

// The mean of one curve of the trials over subjects, point by point, one row per treatment; of
// subjects whose curve is as long as the first one's.
std::vector<BoxRow> MeanCurves(const StudyResults& results, const std::vector<Treatment>& ranked,
                               std::vector<double> TrialRow::*curve) {
  std::vector<BoxRow> rows;
  for (const Treatment& treatment : ranked) {
    BoxRow mean{treatment.label, {}};
    int count = 0;
    for (const TrialRow& row : results.trials) {
      const std::vector<double>& values = row.*curve;
      if (row.values == treatment.values && row.status == "done" &&
          (count == 0 || values.size() == mean.values.size())) {
        mean.values.resize(values.size(), 0);
        for (std::size_t k = 0; k < values.size(); ++k) {
          mean.values[k] += values[k];
        }
        ++count;
      }
    }
    for (double& value : mean.values) {
      value /= count;
    }
    if (!mean.values.empty()) {
      rows.push_back(std::move(mean));
    }
  }
  return rows;
}

// One plot of stated against observed shares, where a treatment states a standard deviation.
std::vector<ReportImage> CalibrationPlots(const StudyResults& results,
                                          const std::vector<Treatment>& ranked) {
  std::vector<ReportImage> plots;
  const auto add = [&](std::vector<double> TrialRow::*curve, const std::string& of_what) {
    const auto rows = MeanCurves(results, ranked, curve);
    if (!rows.empty()) {
      plots.push_back(
          {CalibrationPlotSvg(rows, "share that the stated standard deviation should hold (%)"),
           fmt::format("Calibration: share of {} within what the stated standard deviation should "
                       "hold, averaged over subjects. On the grey line it is right; below, too "
                       "bold; above, too cautious.",
                       of_what),
           fmt::format("observed against stated share of {}, one line per treatment", of_what)});
    }
  };
  add(&TrialRow::depth_coverage, "the true depths over the scored bone");
  add(&TrialRow::left_out_coverage, "the dowels that were left out");
  return plots;
}

ReportSection CurvesSection(const StudyResults& results, const std::vector<Treatment>& ranked) {
  ReportSection section{.heading = "Errors, convergence, calibration"};
  const auto errors = MeanCurves(results, ranked, &TrialRow::quantiles_mm);
  const auto steps = MeanCurves(results, ranked, &TrialRow::step_rms_mm);
  if (!errors.empty()) {
    section.images.push_back(
        {QuantilePlotSvg(errors, "distance of the H-spline face from the true skin (mm)"),
         "Share of the scored skin within each distance, quantiles averaged over subjects, up to "
         "95 %.",
         "cumulative distribution of the face's error, one line per treatment"});
  }
  if (!steps.empty()) {
    section.images.push_back(
        {ConvergencePlotSvg(steps, "RMS distance of the fitted points (mm)"),
         "Convergence: after each step of the last round's schedule, averaged over subjects.",
         "root mean square distance by step of the schedule, one line per treatment"});
  }
  std::ranges::move(CalibrationPlots(results, ranked), std::back_inserter(section.images));
  return section;
}

std::vector<BoxRow> Boxes(const std::vector<Treatment>& ranked) {
  std::vector<BoxRow> rows;
  for (const Treatment& treatment : ranked) {
    rows.push_back({treatment.label, ValuesOf(treatment)});
  }
  return rows;
}

// Of each subject in turn all treatments, the best first, so that the view compares them there.
SceneCollection Scenes(const StudyResults& results, const std::filesystem::path& root) {
  constexpr std::size_t kLimit_bytes = 12'000'000;
  std::vector<std::string> subjects;
  for (const TrialRow& row : results.trials) {
    if (std::find(subjects.begin(), subjects.end(), row.subject) == subjects.end()) {
      subjects.push_back(row.subject);
    }
  }
  std::vector<SceneText> scenes;
  for (const std::string& subject : subjects) {
    for (const Treatment& treatment : Ranked(Treatments(results, results.metric))) {
      for (const std::size_t n : treatment.trials) {
        const TrialRow& row = results.trials[n];
        const std::filesystem::path file = root / "trials" / row.id / "scene.json";
        if (row.subject == subject && scenes.size() < kMostScenes &&
            std::filesystem::exists(file)) {
          scenes.push_back({fmt::format("{} | {}", treatment.label, subject), ReadFileBytes(file)});
        }
      }
    }
  }
  return scenes.empty() ? SceneCollection{} : CollectScenes(scenes, kLimit_bytes);
}

// The depth maps that the trials left, best treatment first.
std::vector<ReportImage> DepthMaps(const StudyResults& results, const std::filesystem::path& root) {
  std::vector<ReportImage> maps;
  for (const Treatment& treatment : Ranked(Treatments(results, results.metric))) {
    for (const std::size_t n : treatment.trials) {
      const TrialRow& row = results.trials[n];
      const std::filesystem::path file = root / "trials" / row.id / "depth.png";
      if (maps.size() < kMostScenes && std::filesystem::exists(file)) {
        maps.push_back(
            ReportImageFromFile(file, fmt::format("{}, {}", treatment.label, row.subject),
                                fmt::format("tissue depth on the skull of {} by {}, and its error",
                                            row.subject, treatment.label)));
      }
    }
  }
  return maps;
}

std::string SceneNote(const StudyResults& results, const SceneCollection& scenes) {
  const int left = results.Count("done") - scenes.count;
  return scenes.count == 0 || left == 0
             ? ""
             : fmt::format(
                   "{} of {} trials are here, best treatments first, subject by subject, to keep "
                   "this file small; each other one can be run by itself from its trial.json.",
                   scenes.count, results.Count("done"));
}

std::vector<ReportTile> Tiles(const StudyResults& results, const std::vector<Treatment>& ranked) {
  std::vector<ReportTile> tiles = {
      {"trials done", std::to_string(results.Count("done")), "",
       fmt::format("of {}", results.trials.size())},
      {"failed", std::to_string(results.Count("failed")), "", ""},
      {"missing", std::to_string(results.Count("missing")), "", "not run yet"}};
  if (!ranked.empty() && !ranked[0].by_subject.empty()) {
    tiles.push_back(
        {"best mean", TableNumber(Summarize(ValuesOf(ranked[0])).mean), "", ranked[0].label});
  }
  return tiles;
}

ReportSection TreatmentsSection(const StudyResults& results, const std::vector<Treatment>& ranked) {
  ReportSection section{.heading = "Treatments"};
  section.tables = {RankingTable(ranked, results.metric)};
  if (ranked.size() > 1) {
    section.tables.push_back(PairsTable(ranked));
    section.images = {{CumulativePlotSvg(Boxes(ranked), results.metric),
                       "Share of subjects below each value.",
                       "cumulative distribution of the metric, one line per treatment"}};
  }
  return section;
}

// What the metric says of the treatments; sections with nothing in them are left out.
std::vector<ReportSection> MetricSections(const StudyResults& results,
                                          const std::vector<Treatment>& ranked,
                                          const std::vector<ReportImage>& maps) {
  if (ranked.empty() || ranked[0].by_subject.empty()) {
    return {
        {.heading = "No value",
         .paragraphs = {fmt::format("No finished trial has a value of '{}'.", results.metric)}}};
  }
  std::vector<ReportSection> sections = {TreatmentsSection(results, ranked)};
  if (ranked.size() > 1) {
    sections.push_back(RankSection(ranked));
  }
  std::ranges::move(IdentifySections(results, ranked), std::back_inserter(sections));
  sections.push_back({.heading = "Behind the metric", .tables = Subtables(results, ranked)});
  sections.push_back(CurvesSection(results, ranked));
  sections.push_back({.heading = "Depth maps", .images = maps});
  std::erase_if(sections, [](const ReportSection& section) {
    return section.paragraphs.empty() && section.images.empty() && section.tables.empty();
  });
  return sections;
}

std::string ReportOf(const StudyResults& results, const SceneCollection& scenes,
                     const std::vector<ReportImage>& maps) {
  const std::vector<Treatment> ranked = Ranked(Treatments(results, results.metric));
  Report report;
  report.title = results.title;
  report.subtitle = fmt::format(
      "Study {} over {}", results.hash,
      results.axes.empty() ? "subjects alone" : fmt::format("{}", fmt::join(results.axes, ", ")));
  report.tiles = Tiles(results, ranked);
  if (!ranked.empty() && !ranked[0].by_subject.empty()) {
    report.main_images = {{BoxPlotSvg(Boxes(ranked), results.metric),
                           "One dot per subject; box: quartiles and median.",
                           "box plot of the metric, one row per treatment"}};
  }
  report.sections = MetricSections(results, ranked, maps);
  report.scenes = scenes.json;
  report.scenes_note = SceneNote(results, scenes);
  report.sections.push_back(TrialsSection(results));
  report.footer = "semblance " SEMBLANCE_VERSION;
  return ReportHtml(report);
}

}  // namespace

StudyResults WriteStudyTables(OutputFolder& folder) {
  StudyResults results = ReadStudyResults(folder.Root());
  folder.Write("trials.csv", TrialsCsv(results));
  folder.Write("summary.csv", SummaryCsv(results));
  folder.Write("results.sqlite", ResultsSqlite(results));
  folder.Write("report.html", ReportOf(results, Scenes(results, folder.Root()),
                                       DepthMaps(results, folder.Root())));
  return results;
}

}  // namespace semblance
