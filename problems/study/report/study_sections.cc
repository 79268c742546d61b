// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/study_sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "problems/config/value_filter.h"
#include "problems/experiment/metrics/identification.h"
#include "problems/report/plain_names.h"
#include "problems/report/plots/heat_map.h"
#include "problems/report/plots/svg_plot.h"
#include "problems/study/report/study_ranking.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {
// ---------------------------------------------------------------------------------------------
// Charts
// ---------------------------------------------------------------------------------------------

namespace {

bool IsNumeric(const std::vector<Treatment>& treatments, std::size_t axis) {
  std::set<double> values;
  for (const Treatment& treatment : treatments) {
    const auto value = NumberIn(treatment.values[axis]);
    if (!value) {
      return false;
    }
    values.insert(*value);
  }
  return values.size() > 1;
}

// The label of a treatment without one axis.
std::string LabelWithout(const StudyResults& results, const Treatment& treatment,
                         std::size_t axis) {
  std::vector<std::string> axes = results.axes, values = treatment.values;
  axes.erase(axes.begin() + static_cast<long>(axis));
  values.erase(values.begin() + static_cast<long>(axis));
  return axes.empty() ? "all" : TreatmentLabel(axes, values);
}

std::vector<AxisLine> LinesAlong(const StudyResults& results, const std::vector<Treatment>& ranked,
                                 std::size_t axis) {
  std::vector<AxisLine> lines;
  std::map<std::string, std::size_t> index;
  for (const Treatment& treatment : ranked) {
    const double mean = MeanOverSubjects(treatment);
    if (!std::isfinite(mean)) {
      continue;
    }
    const std::string label = LabelWithout(results, treatment, axis);
    const auto [at, is_new] = index.try_emplace(label, lines.size());
    if (is_new) {
      lines.push_back({label, {}});
    }
    lines[at->second].points.push_back({*NumberIn(treatment.values[axis]), mean,
                                        fmt::format("{}: {:.6g}", treatment.label, mean)});
  }
  return lines;
}

std::vector<std::string> ListSubjects(const StudyResults& results) {
  std::vector<std::string> subjects;
  for (const TrialRow& row : results.trials) {
    if (std::ranges::find(subjects, row.subject) == subjects.end()) {
      subjects.push_back(row.subject);
    }
  }
  return subjects;
}

std::string LinkTo(const StudyResults& results, const Treatment& treatment,
                   const std::string& subject) {
  for (const std::size_t n : treatment.trials) {
    if (results.trials[n].subject == subject) {
      return TrialHref(results, results.trials[n]);
    }
  }
  return "";
}

}  // namespace

std::string TrialAnchor(const TrialRow& row) { return "t-" + row.id; }

std::string TrialHref(const StudyResults& results, const TrialRow& row) {
  return results.trials.size() <= kMostListedTrials ? "#" + TrialAnchor(row)
                                                    : fmt::format("trials/{}/trial.json", row.id);
}

std::vector<ReportImage> AxisPlots(const StudyResults& results,
                                   const std::vector<Treatment>& ranked) {
  std::vector<ReportImage> plots;
  for (std::size_t axis = 0; axis < results.axes.size(); ++axis) {
    if (!IsNumeric(ranked, axis)) {
      continue;
    }
    const std::vector<AxisLine> lines = LinesAlong(results, ranked, axis);
    if (!lines.empty()) {
      plots.push_back({AxisPlotSvg(lines, results.axes[axis], WordsOfMetric(results.metric)),
                       fmt::format("Mean over subjects along {}.", results.axes[axis]),
                       fmt::format("the metric against {}", results.axes[axis])});
    }
  }
  return plots;
}

std::vector<ReportImage> SubjectMap(const StudyResults& results,
                                    const std::vector<Treatment>& ranked) {
  constexpr std::size_t kLargestMap = 40;  // rows and columns that stay readable
  std::vector<std::string> subjects = ListSubjects(results);
  if (subjects.size() < 2 || ranked.size() < 2) {
    return {};
  }
  const std::size_t rows = std::min(ranked.size(), kLargestMap);
  const bool is_cut = ranked.size() > kLargestMap || subjects.size() > kLargestMap;
  subjects.resize(std::min(subjects.size(), kLargestMap));
  HeatMap map{
      .rows = {}, .columns = subjects, .values = {}, .title = WordsOfMetric(results.metric)};
  for (std::size_t r = 0; r < rows; ++r) {
    map.rows.push_back(ranked[r].label);
    map.values.emplace_back();
    map.links.emplace_back();
    for (const std::string& subject : subjects) {
      const auto value = ranked[r].by_subject.find(subject);
      map.values.back().push_back(value == ranked[r].by_subject.end() ? kNaN : value->second);
      map.links.back().push_back(LinkTo(results, ranked[r], subject));
    }
  }
  return {{HeatMapSvg(map),
           fmt::format("Best treatment first. A cell links to its trial.{}",
                       is_cut ? " Only the first 40 treatments and subjects are drawn." : ""),
           "the metric of each subject under each treatment, as colours"}};
}

// ---------------------------------------------------------------------------------------------
// Tables
// ---------------------------------------------------------------------------------------------

namespace {

// A column of a table: its head and the metric in it.
struct SectionColumn {
  std::string head, metric;
  int digits = 3;  // decimals
};

// The mean of a function of the metric over the treatment's finished trials. NaN without one.
double MeanOverTrials(const StudyResults& results, const Treatment& treatment,
                      const std::string& metric, double (*function)(double)) {
  double sum = 0;
  int count = 0;
  for (const std::size_t n : treatment.trials) {
    const auto& metrics = results.trials[n].metrics;
    if (const auto it = metrics.find(metric); it != metrics.end()) {
      sum += function(it->second);
      ++count;
    }
  }
  return count > 0 ? sum / count : kNaN;
}
double Identity(double x) { return x; }
double Square(double x) { return x * x; }

ReportTable MeansTable(const StudyResults& results, const std::vector<Treatment>& ranked,
                       const std::string& caption, const std::vector<SectionColumn>& columns) {
  ReportTable table{caption, {"treatment"}};
  const auto is_known = [&](const std::string& metric) {
    return std::ranges::any_of(results.trials,
                               [&](const TrialRow& row) { return row.metrics.contains(metric); });
  };
  for (const Treatment& treatment : ranked) {
    table.AddRow(treatment.label);
  }
  for (const SectionColumn& column : columns) {
    if (is_known(column.metric)) {
      table.header.push_back(column.head);
      for (std::size_t n = 0; n < ranked.size(); ++n) {
        table.rows[n].push_back(TableNumber(
            MeanOverTrials(results, ranked[n], column.metric, Identity), column.digits));
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

// The names n of all metrics `prefix`n`suffix`, sorted. A name holds no dot.
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

// A remark for columns of the metric itself, unless lower values are better.
std::string Direction(const StudyResults& results) {
  return results.preference.better == Better::kLower ? "" : ", " + results.preference.ToPhrase();
}

bool HigherIsBetter(const StudyResults& results) {
  return results.preference.better == Better::kHigher;
}

ReportTable SiblingsTable(const StudyResults& results, const std::vector<Treatment>& ranked,
                          const std::string& parent) {
  std::vector<SectionColumn> columns;
  if (HigherIsBetter(results)) {  // the metric is not an error, so it is not among those below
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
  return MeansTable(
      results, ranked,
      HigherIsBetter(results)
          ? "The metric and the error by other measures (lower is better), means over "
            "subjects"
          : "The same error by other measures, means over subjects",
      columns);
}

ReportTable RegionsTable(const StudyResults& results, const std::vector<Treatment>& ranked,
                         const std::string& parent, const std::string& leaf) {
  std::vector<SectionColumn> columns;
  const std::string prefix = parent + "regions.", suffix = "." + leaf;
  for (const std::string& name : NamesBetween(results, prefix, suffix)) {
    columns.push_back({name, prefix + name + suffix});
  }
  return MeansTable(results, ranked,
                    fmt::format("{} by part of the face, means over subjects{}",
                                WordsOfMeasure(leaf), Direction(results)),
                    columns);
}

constexpr const char* kTruthScores = "depth_truth.along_direction.scores.all.";
constexpr const char* kLeftOutScores = "cross_validation.landmark.scores.scheme.";
constexpr const char* kSideScores = "cross_validation.side.scores.scheme.";

ReportTable ScoresTable(const StudyResults& results, const std::vector<Treatment>& ranked,
                        const std::string& caption, const std::string& prefix) {
  std::vector<SectionColumn> columns;
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
      })) {  // their infinite log score is in no mean
    columns.push_back({"stated as certain", prefix + "certain", 1});
  }
  return MeansTable(results, ranked, caption, columns);
}

// Each treatment's score minus that of the first, over the subjects that both have.
ReportTable PairedScoresTable(const StudyResults& results, const std::vector<Treatment>& ranked) {
  ReportTable table{"", {"treatment"}};
  if (ranked.size() < 2) {
    return table;
  }
  table.caption = fmt::format(
      "Scores minus those of {}, paired by subject: mean difference (worse "
      "in how many subjects)",
      ranked[0].label);
  for (const Treatment& treatment : ranked) {
    table.AddRow(treatment.label);
  }
  for (const auto& [head, metric] : std::to_array<std::pair<const char*, std::string>>(
           {{"true depth: CRPS (mm)", fmt::format("{}crps_mm", kTruthScores)},
            {"true depth: log score", fmt::format("{}log_score", kTruthScores)},
            {"true depth: interval (mm)", fmt::format("{}interval_score_90_mm", kTruthScores)},
            {"landmarks: CRPS (mm)", fmt::format("{}crps_mm", kLeftOutScores)},
            {"landmarks: log score", fmt::format("{}log_score", kLeftOutScores)}})) {
    const auto treatments = Treatments(results, metric);
    const auto by_subject = [&](const Treatment& t) {
      return std::ranges::find(treatments, t.values, &Treatment::values)->by_subject;
    };
    const auto first = by_subject(ranked[0]);
    if (first.empty()) {
      continue;
    }
    table.header.emplace_back(head);
    for (std::size_t n = 0; n < ranked.size(); ++n) {
      table.rows[n].push_back(DifferenceText(by_subject(ranked[n]), first));
    }
  }
  if (table.header.size() == 1) {
    table.rows.clear();
  }
  return table;
}

ReportTable LeftOutTable(const StudyResults& results, const std::vector<Treatment>& ranked) {
  std::vector<SectionColumn> columns;
  for (const auto& [kind, words] : std::to_array<std::pair<const char*, const char*>>(
           {{"landmark", "a landmark"}, {"side", "a side"}, {"k_fold", "a random part"}})) {
    columns.push_back(
        {fmt::format("{}: RMS (mm)", words), fmt::format("cross_validation.{}.rms_mm", kind)});
    columns.push_back({fmt::format("{}: within 90 %", words),
                       fmt::format("cross_validation.{}.coverage_90", kind)});
  }
  return MeansTable(results, ranked, "Depth markers left out and predicted, means over subjects",
                    columns);
}

// The weight of each scheme in treatments that average schemes.
ReportTable SharesTable(const StudyResults& results, const std::vector<Treatment>& ranked) {
  const std::string prefix = "depth.shares.";
  std::vector<SectionColumn> columns;
  for (const std::string& name : NamesBetween(results, prefix, "")) {
    columns.push_back({name, prefix + name});
  }
  ReportTable table = MeansTable(
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
      "RMS error (mm) of each depth marker when its landmark is left out, over subjects", {"site"}};
  for (const Treatment& treatment : ranked) {
    table.header.push_back(treatment.label);
  }
  for (const std::string& site : NamesBetween(results, prefix, "")) {
    std::vector<std::string> row = {site};
    for (const Treatment& treatment : ranked) {
      row.push_back(
          TableNumber(std::sqrt(MeanOverTrials(results, treatment, prefix + site, Square))));
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
  scores("landmarks left out, where the scheme itself predicts", kLeftOutScores);
  scores("a side left out, where the scheme itself predicts", kSideScores);
  tables.push_back(PairedScoresTable(results, ranked));
  tables.push_back(SharesTable(results, ranked));
  return WithoutEmptyTables(std::move(tables));
}

// ---------------------------------------------------------------------------------------------
// Identification
// ---------------------------------------------------------------------------------------------

namespace {

using SectionBySubject = std::map<std::string, double>;

// A kind of face with the rank of its own person, by subject.
struct Probe {
  std::string label;
  SectionBySubject rank;

  std::vector<double> Ranks() const {
    std::vector<double> ranks;
    for (const auto& [subject, value] : rank) {
      ranks.push_back(value);
    }
    return ranks;
  }
};

// The metric of a treatment's trials.
SectionBySubject CollectMetric(const StudyResults& results, const Treatment& treatment,
                               const std::string& metric) {
  SectionBySubject values;
  for (const std::size_t n : treatment.trials) {
    const TrialRow& row = results.trials[n];
    if (const auto it = row.metrics.find(metric); it != row.metrics.end()) {
      values[row.subject] = it->second;
    }
  }
  return values;
}

// The treatments, then the ceiling and the floor, which are the same for all of them.
std::vector<Probe> CollectProbes(const std::string& measure, const StudyResults& results,
                                 const std::vector<Treatment>& ranked) {
  std::vector<Probe> probes;
  for (const Treatment& t : ranked) {
    probes.push_back(
        {t.label, CollectMetric(results, t, fmt::format("identify.{}.rank", measure))});
  }
  for (const auto& [path, label] : {std::pair("ceiling", "ceiling: the true face, seen again"),
                                    std::pair("floor", "floor: the generic face")}) {
    probes.push_back({label, CollectMetric(results, ranked.front(),
                                           fmt::format("identify.{}.{}.rank", path, measure))});
  }
  std::erase_if(probes, [](const Probe& probe) { return probe.rank.empty(); });
  return probes;
}

// The share of faces whose person is among the first k.
std::string Share(const std::vector<double>& ranks, int gallery, int k) {
  if (k > gallery) {
    return "";
  }
  const double share = CumulativeMatch(ranks, gallery)[static_cast<std::size_t>(k - 1)];
  return fmt::format("{:.0f} % ({} of {})", 100 * share,
                     std::lround(share * static_cast<double>(ranks.size())), ranks.size());
}

std::vector<double> Gains(const Probe& probe, const Probe& floor) {
  std::vector<double> gains;
  for (const auto& [subject, rank] : probe.rank) {
    if (const auto it = floor.rank.find(subject); it != floor.rank.end()) {
      gains.push_back(it->second - rank);
    }
  }
  return gains;
}

ReportTable RanksTable(const std::vector<Probe>& probes, int gallery) {
  constexpr int kMinSubjects = 6;  // five cannot reach p < 0.05 in a two-sided test
  ReportTable table{fmt::format("Ranks in a gallery of {}; by chance the mean is {}", gallery,
                                ChanceRank(gallery)),
                    {"face", "rank 1", "rank 5", "mean rank", "gained over the floor",
                     "95 % interval", "Wilcoxon p"},
                    {}};
  const Probe& floor = probes.back();
  for (const Probe& probe : probes) {
    const std::vector<double> ranks = probe.Ranks(), gains = Gains(probe, floor);
    const SampleSummary gain = Summarize(gains);
    const bool is_floor = &probe == &floor;
    const double p = !is_floor && gain.n >= kMinSubjects ? Wilcoxon(gains).p : kNaN;
    table.AddRow(probe.label, Share(ranks, gallery, 1), Share(ranks, gallery, 5),
                 Summarize(ranks).mean, is_floor ? kNaN : gain.mean,
                 is_floor ? "" : IntervalText(gain.mean_95), TableNumber(p, 4));
  }
  return table;
}

std::vector<BoxRow> Rows(const std::vector<Probe>& probes) {
  std::vector<BoxRow> rows;
  for (const Probe& probe : probes) {
    rows.push_back({probe.label, probe.Ranks()});
  }
  return rows;
}

ReportSection IdentifySection(const std::string& measure, const std::string& words,
                              const StudyResults& results, const std::vector<Treatment>& ranked,
                              int gallery) {
  ReportSection section{.heading = fmt::format("Identification by {}", words)};
  const std::vector<Probe> probes = CollectProbes(measure, results, ranked);
  if (probes.size() < 2) {
    return section;
  }
  section.images = {
      {CumulativePlotSvg(Rows(probes), "rank of the right person"),
       "Cumulative match characteristic: share of faces whose person is among the first so many.",
       fmt::format("cumulative match characteristic by {}, with ceiling and floor", words)}};
  section.tables = {RanksTable(probes, gallery)};
  return section;
}

// The size of the gallery, with a warning if it is small.
std::string GalleryWords(int gallery) {
  constexpr int kSmallGallery = 100;  // people
  const std::string size = fmt::format("The gallery holds {} people.", gallery);
  return gallery >= kSmallGallery
             ? size
             : size + fmt::format(
                          " That is small: by chance {:.0f} % of the faces would come first, "
                          "and the ranks do not carry over to a gallery of hundreds.",
                          100.0 / gallery);
}

int GallerySize(const StudyResults& results) {
  for (const TrialRow& row : results.trials) {
    if (const auto it = row.metrics.find("identify.gallery"); it != row.metrics.end()) {
      return static_cast<int>(it->second);
    }
  }
  return 0;
}

}  // namespace

std::vector<ReportSection> IdentifySections(const StudyResults& results,
                                            const std::vector<Treatment>& ranked) {
  const int gallery = GallerySize(results);
  if (gallery == 0 || ranked.empty()) {
    return {};
  }
  std::vector<ReportSection> sections = {
      IdentifySection("surface", "the surface after alignment", results, ranked, gallery),
      IdentifySection("landmarks", "the configuration of landmarks", results, ranked, gallery)};
  sections.front().paragraphs = {GalleryWords(gallery)};
  return sections;
}

}  // namespace semblance::problems
