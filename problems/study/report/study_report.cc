// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/study_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "problems/report/plain_names.h"
#include "problems/report/plots/svg_plot.h"
#include "problems/report/report_kit.h"
#include "problems/report/scene_json.h"
#include "problems/study/depth_study.h"
#include "problems/study/report/factor_section.h"
#include "problems/study/report/results_sqlite.h"
#include "problems/study/report/study_factors.h"
#include "problems/study/report/study_ranking.h"
#include "problems/study/report/study_sections.h"
#include "problems/study/trial_folder.h"

namespace semblance::problems {
namespace {

constexpr std::size_t kLargestSceneCount = 40;  // entries of one selection list
constexpr int kLeastSubjects = 6;  // five subjects cannot reach p < 0.05 in a two-sided test

std::vector<double> CollectValues(const Treatment& treatment) {
  std::vector<double> values;
  for (const auto& [subject, value] : treatment.by_subject) {
    values.push_back(value);
  }
  return values;
}

// Each treatment links to the first of its trials.
ReportTable RankingTable(const StudyResults& results, const std::vector<Treatment>& ranked) {
  ReportTable table{fmt::format("Treatments by {}, {}{}", WordsOfMetric(results.metric),
                                RankingOrderText(results.preference), LabelPartsText(results)),
                    {"treatment", "rank", "subjects", "not usable", "mean", "mean, 95 % interval",
                     "sd", "median", "min", "max", "mean seconds"}};
  const std::vector<Treatment> compared = RestrictToCommonSubjects(results, ranked);
  for (const Treatment& treatment : ranked) {
    const SampleSummary s = Summarize(CollectValues(compared[table.rows.size()]));
    table.AddRow(treatment.label, s.n > 0 ? std::to_string(table.rows.size() + 1) : "", s.n,
                 treatment.unusable, s.mean, IntervalText(s.mean_95), s.sd, s.median, s.min, s.max,
                 TableNumber(MeanSeconds(results, treatment), 1));
    table.links.push_back(
        treatment.trials.empty() ? "" : TrialHref(results, results.trials[treatment.trials[0]]));
  }
  return table;
}

std::vector<double> Differences(const Treatment& treatment, const Treatment& best,
                                const Preference& preference) {
  std::vector<double> differences;
  for (const auto& [subject, value] : treatment.by_subject) {
    if (const auto other = best.by_subject.find(subject); other != best.by_subject.end()) {
      differences.push_back(preference.Compared(value) - preference.Compared(other->second));
    }
  }
  return differences;
}

ReportTable PairsTable(const StudyResults& results, const std::vector<Treatment>& ranked) {
  ReportTable table{fmt::format("Each treatment minus the best ({}), over the subjects that "
                                "both have{}",
                                ranked[0].label, results.preference.TargetSuffix()),
                    {"treatment", "pairs", "mean difference", "95 % interval", "worse in",
                     "Wilcoxon p", "p, Holm"}};
  std::vector<double> p;
  for (std::size_t n = 1; n < ranked.size(); ++n) {
    const std::vector<double> d = Differences(ranked[n], ranked[0], results.preference);
    const SampleSummary s = Summarize(d);
    const WilcoxonResult w = Wilcoxon(d);
    const bool enough = s.n >= kLeastSubjects && std::isfinite(w.p);
    p.push_back(enough ? w.p : 1);
    const auto worse =
        std::ranges::count_if(d, [&](double x) { return results.preference.IsBetter(0, x); });
    table.AddRow(ranked[n].label, s.n, s.mean, IntervalText(s.mean_95),
                 fmt::format("{} of {}", worse, s.n),
                 enough ? fmt::format("{:.4f}{}", w.p, w.exact ? "" : " (normal)") : "",
                 enough ? "to be adjusted" : "");
  }
  const std::vector<double> adjusted = Holm(p);
  for (std::size_t n = 0; n < table.rows.size(); ++n) {
    std::string& cell = table.rows[n].back();
    cell = cell.empty() ? "" : fmt::format("{:.4f}", adjusted[n]);
  }
  return table;
}

// The costs of the subjects that all treatments have, for Friedman's test. Lower is better.
std::vector<std::vector<double>> CompleteTable(const StudyResults& results,
                                               const std::vector<Treatment>& treatments) {
  std::vector<std::vector<double>> rows;
  for (const auto& [subject, value] : treatments[0].by_subject) {
    std::vector<double> row;
    for (const Treatment& treatment : treatments) {
      if (const auto it = treatment.by_subject.find(subject); it != treatment.by_subject.end()) {
        row.push_back(results.preference.RankingCost(it->second));
      }
    }
    if (row.size() == treatments.size()) {
      rows.push_back(row);
    }
  }
  return rows;
}

// If all subjects agree, F is infinite and has no p-value. The probability of identical orders
// takes its place.
std::string FriedmanWords(const FriedmanResult& f) {
  if (!std::isfinite(f.chi2)) {
    return fmt::format("In all {} subjects the {} treatments have the same value.", f.subjects,
                       f.treatments);
  }
  if (!std::isfinite(f.f)) {
    const double log10_p = (1 - f.subjects) * std::lgamma(f.treatments + 1.0) / std::log(10.0);
    return fmt::format(
        "All {} subjects put the {} treatments in the same order. If the treatments did not "
        "differ, "
        "each order would be equally likely, and this would happen with a probability of {}.",
        f.subjects, f.treatments,
        log10_p > -300 ? fmt::format("{:.2g}", std::pow(10, log10_p)) : "less than 1e-300");
  }
  return fmt::format(
      "Over {} subjects and {} treatments, Friedman's chi-square is {:.3f}. In Iman and "
      "Davenport's form, F = {:.3f}, p {}.",
      f.subjects, f.treatments, f.chi2, f.f,
      f.p < 1e-12 ? "below 1e-12" : fmt::format("= {:.2g}", f.p));
}

// Requires two treatments or more.
ReportSection RankSection(const StudyResults& results, const std::vector<Treatment>& ranked) {
  ReportSection section{.heading = "Do the treatments differ?"};
  const auto rows = CompleteTable(results, ranked);
  if (static_cast<int>(rows.size()) < kLeastSubjects) {
    section.paragraphs = {fmt::format(
        "{} {} a value for all {} treatments. That is too few for a test: at least {} "
        "subjects are needed. Only the differences above are available.",
        rows.empty() ? "No subject" : Counted(static_cast<long long>(rows.size()), "subject"),
        rows.size() < 2 ? "has" : "have", ranked.size(), kLeastSubjects)};
    return section;
  }
  const FriedmanResult f = Friedman(rows);
  std::vector<RankedLabel> labels;
  for (std::size_t n = 0; n < ranked.size(); ++n) {
    labels.push_back({ranked[n].label, f.mean_ranks[n]});
  }
  section.images = {
      {RankPlotSvg(labels, f.critical_difference),
       "Ranks within each subject, averaged. Treatments joined by a grey line do not differ "
       "significantly at 5 % (Nemenyi).",
       "mean ranks of the treatments with the critical difference"}};
  section.paragraphs = {FriedmanWords(f)};
  return section;
}

// The link of a trial: its own report if it was kept, else its trial.json.
std::string TrialLink(const TrialRow& row, const std::filesystem::path& root) {
  for (const char* file : {"report.html", "trial.json"}) {
    if (std::filesystem::exists(TrialFolder(root, row.id) / file)) {
      return fmt::format("trials/{}/{}", row.id, file);
    }
  }
  return "";
}

ReportSection TrialsSection(const StudyResults& results, const std::filesystem::path& root) {
  const bool lists_all = results.trials.size() <= kMostListedTrials;
  ReportTable table{fmt::format("{} trial, with {}", lists_all ? "Every" : "Each such",
                                WordsOfMetric(results.metric)),
                    {"trial", "subject", "treatment", "status", "value", "seconds", "reason"}};
  for (const TrialRow& row : results.trials) {
    if (!lists_all && (row.status == "done" || table.rows.size() == kMostListedTrials)) {
      continue;
    }
    const auto value = row.metrics.find(results.metric);
    table.AddRow(row.id, row.subject, TreatmentLabel(results.axes, row.values), row.status,
                 value == row.metrics.end() ? kNaN : value->second, TableNumber(row.wall_s, 1),
                 row.reason);
    table.ids.push_back(TrialAnchor(row));
    table.links.push_back(TrialLink(row, root));
  }
  ReportSection section{.heading = "Trials", .folded = true};
  if (!lists_all) {
    section.paragraphs = {fmt::format(
        "To keep this file small, only trials that are not done are listed here, at most {}. "
        "trials_wide.csv lists all {}.",
        kMostListedTrials, results.trials.size())};
  }
  section.tables = WithoutEmptyTables({std::move(table)});
  return section;
}

// The mean of one curve over subjects, point by point, one row per treatment. Subjects whose curve
// differs in length from the first one are left out.
std::vector<BoxRow> MeanCurves(const StudyResults& results, const std::vector<Treatment>& ranked,
                               std::vector<double> TrialRow::*curve) {
  std::vector<BoxRow> rows;
  for (const Treatment& treatment : ranked) {
    BoxRow mean{treatment.label, {}};
    int count = 0;
    for (const std::size_t trial : treatment.trials) {
      const std::vector<double>& values = results.trials[trial].*curve;
      if (count == 0 || values.size() == mean.values.size()) {
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

// Plots of stated against observed shares, for treatments that state a standard deviation.
std::vector<ReportImage> CalibrationPlots(const StudyResults& results,
                                          const std::vector<Treatment>& ranked) {
  std::vector<ReportImage> plots;
  const auto add = [&](std::vector<double> TrialRow::*curve, const std::string& of_what) {
    const auto rows = MeanCurves(results, ranked, curve);
    if (!rows.empty()) {
      plots.push_back(
          {CalibrationPlotSvg(rows, "share that the stated standard deviation should hold (%)"),
           fmt::format("Calibration: observed share of {} within the intervals of the stated "
                       "standard deviation, averaged over subjects. A line on the grey line is "
                       "calibrated, below it overconfident, above it too cautious.",
                       of_what),
           fmt::format("observed against stated share of {}, one line per treatment", of_what)});
    }
  };
  add(&TrialRow::depth_coverage, "the true depths over the scored bone");
  add(&TrialRow::left_out_coverage, "the depth markers that were left out");
  return plots;
}

// One histogram per treatment that states a standard deviation.
std::vector<ReportImage> PitPlots(const StudyResults& results,
                                  const std::vector<Treatment>& ranked) {
  std::vector<ReportImage> plots;
  const auto add = [&](std::vector<double> TrialRow::*histogram, const std::string& of_what) {
    const auto rows = MeanCurves(results, ranked, histogram);
    if (!rows.empty()) {
      plots.push_back({HistogramsSvg(rows),
                       fmt::format("Probability integral transform of {}: their position in the "
                                   "stated distribution, averaged over subjects. Bars at the grey "
                                   "line mean calibrated, a heap at both ends overconfident, in "
                                   "the middle too cautious, at one end biased.",
                                   of_what),
                       fmt::format("histogram of the probability integral transform of {}, one "
                                   "per treatment",
                                   of_what)});
    }
  };
  add(&TrialRow::depth_pit, "the true depths over the scored bone");
  add(&TrialRow::left_out_pit, "the landmarks that were left out");
  return plots;
}

ReportSection CurvesSection(const StudyResults& results, const std::vector<Treatment>& ranked) {
  ReportSection section{.heading = "Errors, convergence, calibration", .folded = true};
  const auto errors = MeanCurves(results, ranked, &TrialRow::quantiles_mm);
  const auto steps = MeanCurves(results, ranked, &TrialRow::step_rms_mm);
  if (!errors.empty()) {
    section.images.push_back(
        {QuantilePlotSvg(errors, "distance of the recovered face from the true skin (mm)"),
         "Share of the scored skin within each distance, up to 95 %. Quantiles are averaged over "
         "subjects.",
         "cumulative distribution of the face's error, one line per treatment"});
  }
  if (!steps.empty()) {
    section.images.push_back(
        {ConvergencePlotSvg(steps, "RMS distance of the fitted points (mm)"),
         "Convergence: the distance after each step of the last round's schedule, averaged over "
         "subjects.",
         "root mean square distance by step of the schedule, one line per treatment"});
  }
  std::ranges::move(CalibrationPlots(results, ranked), std::back_inserter(section.images));
  std::ranges::move(PitPlots(results, ranked), std::back_inserter(section.images));
  return section;
}

std::vector<BoxRow> Boxes(const std::vector<Treatment>& ranked) {
  std::vector<BoxRow> rows;
  for (const Treatment& treatment : ranked) {
    rows.push_back({treatment.label, CollectValues(treatment), {}});
    for (const auto& [subject, value] : treatment.by_subject) {
      rows.back().names.push_back(subject);
    }
  }
  return rows;
}

// The scenes subject by subject, best treatment first, so that the view compares treatments of one
// subject.
SceneCollection Scenes(const StudyResults& results, const std::vector<Treatment>& ranked,
                       const std::filesystem::path& root) {
  constexpr std::size_t kLimit_bytes = 12'000'000;  // a page that browsers still open quickly
  std::vector<std::string> subjects;
  for (const TrialRow& row : results.trials) {
    if (std::find(subjects.begin(), subjects.end(), row.subject) == subjects.end()) {
      subjects.push_back(row.subject);
    }
  }
  std::vector<SceneText> scenes;
  for (const std::string& subject : subjects) {
    for (const Treatment& treatment : ranked) {
      for (const std::size_t n : treatment.trials) {
        const TrialRow& row = results.trials[n];
        if (row.subject != subject || scenes.size() >= kLargestSceneCount) {
          continue;
        }
        const std::filesystem::path file = root / "trials" / row.id / "scene.json";
        if (std::filesystem::exists(file)) {
          scenes.push_back({fmt::format("{} | {}", treatment.label, subject), ReadFileBytes(file)});
        }
      }
    }
  }
  return scenes.empty() ? SceneCollection{} : CollectScenes(scenes, kLimit_bytes);
}

// The depth maps of the trials, best treatment first.
std::vector<ReportImage> DepthMaps(const StudyResults& results,
                                   const std::vector<Treatment>& ranked,
                                   const std::filesystem::path& root) {
  const bool has_truth = std::ranges::any_of(results.trials, [](const TrialRow& row) {
    return row.metrics.lower_bound("depth_truth.") != row.metrics.lower_bound("depth_truth/");
  });
  std::vector<ReportImage> maps;
  for (const Treatment& treatment : ranked) {
    for (const std::size_t n : treatment.trials) {
      const TrialRow& row = results.trials[n];
      const std::filesystem::path file = root / "trials" / row.id / "depth.png";
      if (maps.size() < kLargestSceneCount && std::filesystem::exists(file)) {
        maps.push_back(
            ReportImageFromFile(file, fmt::format("{}, {}", treatment.label, row.subject),
                                fmt::format("tissue depth on the skull of {} by {}, and its error",
                                            row.subject, treatment.label),
                                DepthPictureLegends(has_truth)));
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
                   "To keep this file small, {} of {} trials are shown, subject by subject, best "
                   "treatments first. Any other trial can be run by itself from its trial.json.",
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
        {"best mean", TableNumber(Summarize(CollectValues(ranked[0])).mean), "", ranked[0].label});
  }
  return tiles;
}

// Long tables are folded, because each of their rows is a card on a phone.
ReportSection TreatmentsSection(const StudyResults& results, const std::vector<Treatment>& ranked,
                                const std::vector<Treatment>& compared) {
  constexpr std::size_t kMostShown = 6;
  ReportSection section{.heading = "Treatments", .folded = ranked.size() > kMostShown};
  section.tables = {RankingTable(results, ranked)};
  if (ranked.size() > 1) {
    section.tables.push_back(PairsTable(results, ranked));
    section.images = {{CumulativePlotSvg(Boxes(compared), WordsOfMetric(results.metric)),
                       "Share of subjects below each value.",
                       "cumulative distribution of the metric, one line per treatment"}};
  }
  return section;
}

// The sections on the axes. If the treatments are no grid, the numeric axes are drawn as they are.
std::vector<ReportSection> AxisSections(const StudyResults& results,
                                        const std::vector<Treatment>& compared) {
  const FactorGrid grid = FindFactorGrid(results);
  std::vector<ReportSection> sections = FactorSections(results, grid);
  if (grid.subjects.empty()) {
    sections.push_back({.heading = "Along each axis", .images = AxisPlots(results, compared)});
  }
  return sections;
}

// The sections about the metric. Empty sections are left out.
std::vector<ReportSection> MetricSections(const StudyResults& results,
                                          const std::vector<Treatment>& ranked,
                                          const std::vector<ReportImage>& maps) {
  if (ranked.empty() || ranked[0].by_subject.empty()) {
    return {
        {.heading = "No value",
         .paragraphs = {fmt::format("No finished trial has a value of '{}'.", results.metric)}}};
  }
  const std::vector<Treatment> compared = RestrictToCommonSubjects(results, ranked);
  std::vector<ReportSection> sections = AxisSections(results, compared);
  sections.push_back(TreatmentsSection(results, ranked, compared));
  if (ranked.size() > 1) {
    sections.push_back(RankSection(results, compared));
  }
  sections.push_back({.heading = "Subject by subject", .images = SubjectMap(results, ranked)});
  std::ranges::move(IdentifySections(results, compared), std::back_inserter(sections));
  sections.push_back(
      {.heading = "Further tables", .tables = Subtables(results, compared), .folded = true});
  sections.push_back(CurvesSection(results, compared));
  sections.push_back({.heading = "Depth maps", .images = maps, .folded = true});
  std::erase_if(sections, [](const ReportSection& section) {
    return section.paragraphs.empty() && section.images.empty() && section.tables.empty();
  });
  return sections;
}

// Failed and missing trials come before other notes.
std::vector<std::string> StudyNotes(const StudyResults& results,
                                    const std::vector<Treatment>& ranked) {
  std::vector<std::string> notes;
  const int failed = results.Count("failed"), missing = results.Count("missing");
  if (failed > 0) {
    notes.push_back(
        fmt::format("{} failed; the table of trials has the reasons.", Counted(failed, "trial")));
  }
  if (const std::string unusable = UnusableText(results); !unusable.empty()) {
    notes.push_back(unusable + ".");
  }
  if (const std::string without = MissingMetricText(results); !without.empty()) {
    notes.push_back(without + ".");
  }
  if (const std::string damaged = DamageText(results); !damaged.empty()) {
    notes.push_back(damaged + ".");
  }
  if (missing > 0) {
    notes.push_back(fmt::format("{} not run yet, so the results may still change.",
                                Counted(missing, "trial is", "trials are")));
  }
  if (const std::string common = CommonSubjectsText(ranked); !common.empty()) {
    notes.push_back(common);
  }
  notes.insert(notes.end(), results.notes.begin(), results.notes.end());
  return notes;
}

}  // namespace

std::string StudyReportHtml(const StudyResults& results, const std::filesystem::path& folder) {
  const std::vector<Treatment> ranked = RankTreatments(results);
  const SceneCollection scenes = Scenes(results, ranked, folder);
  const std::vector<ReportImage> maps = DepthMaps(results, ranked, folder);
  Report report;
  report.title = results.title;
  report.subtitle = fmt::format(
      "Study {} over {}", results.hash,
      results.axes.empty() ? "subjects alone" : fmt::format("{}", fmt::join(results.axes, ", ")));
  const std::vector<Treatment> compared = RestrictToCommonSubjects(results, ranked);
  report.tiles = Tiles(results, compared);
  if (!ranked.empty() && !ranked[0].by_subject.empty()) {
    report.main_images = {SubjectBoxPlot(Boxes(compared), WordsOfMetric(results.metric),
                                         "box plot of the metric, one row per treatment")};
  }
  report.sections = MetricSections(results, ranked, maps);
  report.scenes = scenes.json;
  report.scenes_note = SceneNote(results, scenes);
  report.notes = StudyNotes(results, ranked);
  report.sections.push_back(TrialsSection(results, folder));
  return ReportHtml(report);
}

StudyResults WriteStudyTables(OutputFolder& folder) {
  StudyResults results = ReadStudyResults(folder.Root(), TrialCheck::kShown);
  // One after the other, because the tables of a large study take hundreds of megabytes each.
  folder.Write("trials.csv", TrialsCsv(results));
  folder.Write("trials_wide.csv", TrialsWideCsv(results));
  folder.Write("summary.csv", SummaryCsv(results));
  folder.Write("results.sqlite", ResultsSqlite(results));
  folder.Write("report.html", StudyReportHtml(results, folder.Root()));
  return results;
}

}  // namespace semblance::problems
