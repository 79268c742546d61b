// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "interp/evaluation/scores.h"
#include "problems/population/depth_modes.h"
#include "problems/report/pictures/image.h"
#include "problems/report/pictures/pictures.h"
#include "problems/report/plots/heat_map.h"
#include "problems/report/plots/svg_plot.h"
#include "problems/report/report_kit.h"
#include "problems/subject/sites.h"

namespace semblance::problems {
namespace {

std::string WayText(const std::string& name) {
  constexpr std::array<std::array<const char*, 2>, 4> kWords = {
      {{"mean", "mean of the others"},
       {"person", "given sex, build, age, body mass"},
       {"known", "given a few measured depths"},
       {"person_known", "given both"}}};
  const auto at = std::ranges::find_if(kWords, [&](const auto& pair) { return pair[0] == name; });
  return at == kWords.end() ? "table " + name : (*at)[1];
}

const PredictedSites* BestWay(const PopulationResult& result) {
  const auto best = std::ranges::min_element(
      result.predictions, {}, [](const PredictedSites& way) { return way.scores.mae_mm; });
  return best == result.predictions.end() ? nullptr : &*best;
}

std::vector<ReportTile> Tiles(const PopulationResult& result) {
  std::vector<ReportTile> tiles = {
      {"subjects", std::to_string(result.counted.size()), "",
       fmt::format("{} failed, {} missing", result.Count("failed"), result.Count("missing"))},
      {"sites", std::to_string(result.table.rows.size()), "", ""},
      {"outliers", result.LooksForOutliers() ? std::to_string(result.outliers.size()) : "-", "",
       !result.LooksForOutliers()       ? "not looked for"
       : result.file.outliers.leave_out ? "left out"
                                        : "listed, not left out"},
      {"correlations", fmt::format("{:.0f}", 100 * (1 - result.joint.shrinkage)), "%",
       "from the subjects; the rest is from a model"}};
  if (!result.predictions.empty() && result.predictions[0].scores.points > 0) {
    tiles.push_back({"a subject left out",
                     fmt::format("{:.2f}", result.predictions[0].scores.mae_mm), "mm",
                     "mean absolute error of the others' mean"});
    tiles.push_back({"at best", fmt::format("{:.2f}", BestWay(result)->scores.mae_mm), "mm",
                     WayText(BestWay(result)->name)});
  }
  return tiles;
}

ReportTable ForesightTable(const PopulationResult& result) {
  ReportTable table{
      .caption = "Each subject predicted by the others, mm",
      .header = {"prediction", "depths", "MAE", "RMSE", "bias", "CRPS", "interval score",
                 "within 50 %", "90 %", "95 %", "sd stated", "MAE minus that of the mean, 95 %"}};
  for (const PredictedSites& way : result.predictions) {
    const DepthScores& s = way.scores;
    const SampleSummary& d = way.against_mean_mm;
    table.AddRow(WayText(way.name), s.points, s.mae_mm, s.rmse_mm, s.bias_mm, s.crps_mm,
                 s.interval_score_90_mm, s.coverage_50, s.coverage_90, s.coverage_95, s.mean_sd_mm,
                 std::isfinite(d.mean_95.low) ? fmt::format("{:+.3f} ({:+.3f} to {:+.3f})", d.mean,
                                                            d.mean_95.low, d.mean_95.high)
                 : std::isfinite(d.mean)      ? fmt::format("{:+.3f}", d.mean)
                                              : "");
  }
  return table;
}

// One row per way of predicting: the mean absolute error of each subject.
std::vector<BoxRow> ErrorRows(const PopulationResult& result) {
  std::vector<BoxRow> rows;
  for (const PredictedSites& way : result.predictions) {
    BoxRow& row = rows.emplace_back(BoxRow{WayText(way.name), {}, {}});
    for (std::size_t k = 0; k < way.mae_mm.size(); ++k) {
      if (std::isfinite(way.mae_mm[k])) {
        row.values.push_back(way.mae_mm[k]);
        row.names.push_back(result.subjects[result.counted[k]].person.name);
      }
    }
  }
  return rows;
}

// One row per way that states a standard deviation: its coverage.
std::vector<BoxRow> CoverageRows(const PopulationResult& result) {
  std::vector<BoxRow> rows;
  for (const PredictedSites& way : result.predictions) {
    std::vector<double> errors, sds;
    for (const PredictedDepth& depth : way.depths) {
      errors.push_back(depth.predicted_mm - depth.depth_mm);
      sds.push_back(depth.sd_mm);
    }
    if (way.scores.stated > 0) {
      rows.push_back({WayText(way.name), Coverage(errors, sds), {}});
    }
  }
  return rows;
}

ReportSection ForesightSection(const PopulationResult& result) {
  ReportSection section{.heading = "How well a person is predicted"};
  section.paragraphs = {fmt::format(
      "Each subject is left out and predicted from the others. Its depths are compared with the "
      "prediction at the sites that every way predicts.{}",
      result.file.known.empty() ? ""
                                : fmt::format(" The few measured depths are those at {}. These "
                                              "sites and their mirror sites are in no score.",
                                              fmt::join(result.file.known, ", ")))};
  section.tables = {ForesightTable(result)};
  section.images = {SubjectBoxPlot(ErrorRows(result), "mean absolute error of a subject, mm",
                                   "box plot of each subject's mean absolute error")};
  if (const auto rows = CoverageRows(result); !rows.empty()) {
    section.images.push_back({CalibrationPlotSvg(rows, "share within the stated interval"),
                              "A line on the diagonal is calibrated, below it overconfident.",
                              "calibration of the stated deviations"});
  }
  return section;
}

ReportSection TableSection(const PopulationResult& result) {
  ReportTable table{.caption = "Tissue depths, mm (table.yaml)",
                    .header = {"site", "name", "mean", "sd", "subjects"}};
  for (const TissueRow& row : result.table.rows) {
    const TissueCell& cell = row.values.at("adult");
    table.AddRow(row.site, row.name, cell.mean.value_or(kNaN), cell.sd.value_or(kNaN),
                 cell.n.value_or(0));
  }
  HeatMap map{.rows = result.joint.names,
              .columns = result.joint.names,
              .values = {},
              .title = "correlation"};
  for (Eigen::Index i = 0; i < result.joint.correlation.rows(); ++i) {
    const auto row = result.joint.correlation.row(i);
    map.values.emplace_back(row.begin(), row.end());
  }
  return {
      .heading = "The table and its correlations",
      .paragraphs = {fmt::format("{:.1f} % of each correlation comes from the model, because so "
                                 "many subjects do not determine it alone.",
                                 100 * result.joint.shrinkage)},
      .images = {{HeatMapSvg(map),
                  "Correlations over people: first the sites, then the other facts about a person.",
                  "heat map of correlations between sites"}},
      .tables = {table}};
}

ReportSection OutlierSection(const PopulationResult& result) {
  ReportTable table{.caption = "Depths and subjects unlike the others",
                    .header = {"subject", "site", "depth (mm)", "expected (mm)", "z"}};
  for (const Outlier& outlier : result.outliers) {
    table.AddRow(result.subjects[outlier.subject].person.name,
                 outlier.site.empty() ? "all sites" : DescribeSite(outlier.site), outlier.depth_mm,
                 outlier.expected_mm, outlier.z);
  }
  ReportSection section{.heading = "Outliers"};
  if (table.rows.empty()) {
    section.paragraphs = {result.LooksForOutliers()
                              ? std::string("None was found.")
                              : fmt::format("The search needs at least {} subjects, because a "
                                            "median of fewer is meaningless.",
                                            kMinSubjectsForOutliers)};
    return section;
  }
  section.paragraphs = {
      result.file.outliers.leave_out
          ? "They are left out of the table, the modes (whole subjects) and the scores."
          : "They are only listed. outliers.leave_out would leave them out of the table."};
  section.tables = {std::move(table)};
  return section;
}

ReportImage MapImage(const DenseMesh& mesh, const std::vector<double>& by_cell,
                     const Legend& legend, std::string caption, std::string alt) {
  constexpr std::array kViews = {View::kFront, View::kThreeQuarter, View::kSide};
  const RenderOptions options{.width = 300, .height = 330, .lighting = Lighting::kEven};
  const Image sheet =
      RenderViews({{MappedObject(mesh.mesh, OnVertices(mesh, by_cell), legend.map)}},
                  Bounds(mesh.mesh), kViews, options, /*threads=*/1);
  return {EncodePng(sheet), std::move(caption), std::move(alt), {legend}};
}

ReportSection DenseSection(const PopulationResult& result) {
  constexpr double kDeepest_mm = 25, kWidest_mm = 6, kLargest_mm = 5;  // ends of the colour maps
  ReportSection section{.heading = "Depth all over the skull"};
  const DenseMesh mesh = MakeDenseMesh(result.dense);
  if (mesh.mesh.triangles.empty()) {
    section.paragraphs = {"No cell of the grid has a depth."};
    return section;
  }
  section.paragraphs = {
      "The (u,v) grid of the generic face is laid on each skull by its landmarks. Positions are "
      "means "
      "over the subjects, in the frame of an average skull. The map of a mode shows the change of "
      "depth by one standard deviation of the mode."};
  section.images = {
      MapImage(mesh, result.dense.mean_mm, {SequentialMap(0, kDeepest_mm), "mean depth"},
               "Mean depth.", "mean depth over the skull"),
      MapImage(mesh, result.dense.sd_mm, {SequentialMap(0, kWidest_mm), "standard deviation"},
               "Standard deviation of the depth.", "standard deviation of depth over the skull")};
  for (std::size_t k = 0; k < result.dense.modes_mm.size(); ++k) {
    section.images.push_back(MapImage(
        mesh, result.dense.modes_mm[k], {DivergingMap(kLargest_mm), "change of depth"},
        fmt::format("Mode {}: {:.1f} % of the variance.", k + 1, 100 * result.dense.share[k]),
        fmt::format("mode {} of depth over the skull", k + 1)));
  }
  return section;
}

ReportSection SubjectSection(const PopulationResult& result) {
  ReportTable table{.caption = "Subjects",
                    .header = {"subject", "status", "landmarks", "sites", "reason"}};
  for (const MeasuredSubject& subject : result.subjects) {
    const auto sites = std::ranges::count_if(
        subject.depths.sites, [](const SiteDepth& site) { return std::isfinite(site.depth_mm); });
    table.AddRow(subject.person.name, subject.status,
                 subject.status != "done"  ? ""
                 : subject.depths.proposed ? "proposed"
                                           : "placed",
                 sites, subject.reason);
  }
  return {.heading = "Subjects", .tables = {table}, .folded = true};
}

}  // namespace

std::string PopulationReport(const PopulationResult& result) {
  Report report;
  report.title = result.file.title;
  report.subtitle = fmt::format("A population of {} subjects", result.counted.size());
  report.notes = result.notes;
  report.tiles = Tiles(result);
  if (!result.predictions.empty()) {
    report.sections.push_back(ForesightSection(result));
  }
  report.sections.push_back(TableSection(result));
  report.sections.push_back(DenseSection(result));
  report.sections.push_back(OutlierSection(result));
  report.sections.push_back(SubjectSection(result));
  return ReportHtml(report);
}

}  // namespace semblance::problems
