// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "problems/config/config.h"
#include "problems/config/terminal_text.h"
#include "problems/io/manifest.h"
#include "problems/population/depth_modes.h"
#include "problems/population/population_report.h"
#include "problems/subject/sites.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

constexpr int kMinSubjects = 3;  // as LeaveOneOut needs

int CountOf(const std::vector<MeasuredSubject>& subjects, const std::string& status) {
  return static_cast<int>(std::ranges::count(subjects, status, &MeasuredSubject::status));
}

std::vector<CountedSubject> Counted(const PopulationResult& result) {
  std::vector<CountedSubject> counted;
  for (const int at : result.counted) {
    counted.push_back({result.subjects[at].person, result.subjects[at].depths});
  }
  return counted;
}

// Notes where outliers were not searched, which differs from finding none.
void NoteUnsearchedOutliers(PopulationResult& result) {
  if (!result.LooksForOutliers()) {
    result.notes.push_back(fmt::format("fewer than {} subjects: outliers are not searched for",
                                       kMinSubjectsForOutliers));
    return;
  }
  int sites = 0, skipped = 0;
  for (Eigen::Index j = 0; j < result.sample.values.cols(); ++j) {
    const bool is_site = IsSite(result.sample.names[j]);
    sites += is_site ? 1 : 0;
    skipped +=
        is_site && result.sample.values.col(j).array().isFinite().count() < kMinSubjectsForOutliers
            ? 1
            : 0;
  }
  if (skipped > 0) {
    result.notes.push_back(fmt::format(
        "outliers are not searched for at {} of {} sites, which fewer than {} subjects have",
        skipped, sites, kMinSubjectsForOutliers));
  }
}

// Finds the outliers, and leaves them out if the options ask for it. Afterwards the `subject` of
// each outlier is an index into result.subjects.
void HandleOutliers(PopulationResult& result) {
  result.outliers = FindOutliers(result.sample, result.joint, result.file.outliers);
  std::set<int> gone;
  for (Outlier& outlier : result.outliers) {
    if (outlier.site.empty()) {
      gone.insert(outlier.subject);
    }
  }
  if (result.file.outliers.leave_out && !result.outliers.empty()) {
    result.sample = WithoutOutliers(std::move(result.sample), result.outliers);
    std::vector<Eigen::Index> kept;
    std::vector<int> counted;
    for (int row = 0; row < static_cast<int>(result.counted.size()); ++row) {
      if (!gone.contains(row)) {
        kept.push_back(row);
        counted.push_back(result.counted[row]);
      }
    }
    result.sample.values = Eigen::MatrixXd(result.sample.values(kept, Eigen::all));
    for (Outlier& outlier : result.outliers) {
      outlier.subject = result.counted[outlier.subject];
    }
    result.counted = counted;
    if (static_cast<int>(counted.size()) < kMinSubjects) {
      throw InputError(fmt::format(
          "{}: without the outliers {} subjects are left; a population needs at least {}",
          result.file.title, counted.size(), kMinSubjects));
    }
    result.joint = FitPopulation(result.sample, result.file.correlation, result.file.shrinkage);
    return;
  }
  for (Outlier& outlier : result.outliers) {
    outlier.subject = result.counted[outlier.subject];
  }
}

DepthModes FindDenseModes(const PopulationResult& result) {
  std::vector<DenseDepths> dense;
  for (const int at : result.counted) {
    dense.push_back(result.subjects[at].depths.dense);
  }
  return FindModes(dense, result.file.measure.dense);
}

std::vector<std::string> CollectNotes(const PopulationResult& result) {
  std::vector<std::string> notes = result.notes;
  const std::size_t dropped = result.sample.names.size() - result.joint.names.size();
  if (dropped > 0) {
    notes.push_back(
        fmt::format("{} of {} numbers are in no correlation, because fewer than two subjects that "
                    "differ have them",
                    dropped, result.sample.names.size()));
  }
  if (result.joint.shrinkage > 0.5) {
    notes.push_back(fmt::format(
        "{:.0f} % of each correlation comes from the model, because the subjects are too few",
        100 * result.joint.shrinkage));
  }
  const auto proposed = std::ranges::count_if(
      result.counted, [&](int at) { return result.subjects[at].depths.proposed; });
  if (proposed > 0) {
    notes.push_back(
        fmt::format("the landmarks of {} subjects were proposed by the program, and no "
                    "person has confirmed them",
                    proposed));
  }
  for (const PredictedSites& way : result.predictions) {
    if (way.assumed > 0) {
      notes.push_back(fmt::format(
          "table {}: the sex or build of {} of {} subjects is not known; an unknown sex counts as "
          "male, an unknown build as normal",
          way.name, way.assumed, result.counted.size()));
    }
  }
  return notes;
}

std::string ScoreLine(const PredictedSites& way) {
  const DepthScores& s = way.scores;
  if (s.points == 0) {
    return fmt::format("a subject left out, {}: no depth to compare\n", way.name);
  }
  return fmt::format("a subject left out, {}: MAE {:.2f} mm, RMSE {:.2f} mm, {}\n", way.name,
                     s.mae_mm, s.rmse_mm,
                     s.stated > 0 ? fmt::format("CRPS {:.2f} mm, within 90 %: {:.1f} % of {}",
                                                s.crps_mm, 100 * s.coverage_90, s.stated)
                                  : fmt::format("no sd stated, {} depths", s.points));
}

using Json = nlohmann::ordered_json;  // writes NaN as null

const std::string& SubjectName(const PopulationResult& result, int row) {
  return result.subjects[result.counted[row]].person.name;
}

std::string DepthsCsv(const PopulationResult& result) {
  CsvWriter csv({"subject", "site", "depth_mm", "confidence", "proposed", "why_not"});
  for (const MeasuredSubject& subject : result.subjects) {
    for (const SiteDepth& site : subject.depths.sites) {
      csv.Row(subject.person.name, site.site, site.depth_mm, site.confidence,
              subject.depths.proposed ? 1 : 0, site.why_not);
    }
  }
  return csv.Text();
}

std::string SubjectsCsv(const std::vector<MeasuredSubject>& subjects) {
  std::vector<std::string> columns = {"subject", "id", "status", "reason", "sites", "cells"};
  for (const std::string& name : CovariateNames()) {
    columns.push_back(name);
  }
  CsvWriter csv(columns);
  for (const MeasuredSubject& subject : subjects) {
    const auto sites = std::ranges::count_if(
        subject.depths.sites, [](const SiteDepth& site) { return std::isfinite(site.depth_mm); });
    const auto cells = std::ranges::count_if(subject.depths.dense.depth_mm,
                                             [](double depth) { return std::isfinite(depth); });
    csv.Add(subject.person.name, subject.id, subject.status, subject.reason, sites, cells);
    const auto known = KnownCovariates({subject.person, subject.depths});
    for (const std::string& name : CovariateNames()) {
      csv.Add(known.contains(name) ? known.at(name) : kNaN);
    }
    csv.EndRow();
  }
  return csv.Text();
}

std::string OutliersCsv(const PopulationResult& result) {
  CsvWriter csv({"subject", "site", "depth_mm", "expected_mm", "z", "left_out"});
  for (const Outlier& outlier : result.outliers) {
    csv.Row(result.subjects[outlier.subject].person.name, outlier.site, outlier.depth_mm,
            outlier.expected_mm, outlier.z, result.file.outliers.leave_out ? 1 : 0);
  }
  return csv.Text();
}

std::string LeaveOneOutCsv(const PopulationResult& result) {
  CsvWriter csv({"way", "subject", "site", "depth_mm", "predicted_mm", "sd_mm"});
  for (const PredictedSites& way : result.predictions) {
    for (const PredictedDepth& depth : way.depths) {
      csv.Row(way.name, SubjectName(result, depth.subject), depth.site, depth.depth_mm,
              depth.predicted_mm, depth.sd_mm);
    }
  }
  return csv.Text();
}

std::string DenseCsv(const DepthModes& dense) {
  std::vector<std::string> columns = {"u", "v", "x", "y", "z", "n", "mean_mm", "sd_mm"};
  for (std::size_t k = 0; k < dense.modes_mm.size(); ++k) {
    columns.push_back(fmt::format("mode_{}_mm", k + 1));
  }
  CsvWriter csv(columns);
  for (int j = 0; j < dense.rows; ++j) {
    for (int i = 0; i < dense.columns; ++i) {
      const std::size_t cell = i + static_cast<std::size_t>(dense.columns) * j;
      const Vec3& p = dense.bone[cell];
      csv.Add((i + 0.5) / dense.columns, (j + 0.5) / dense.rows, p.x(), p.y(), p.z(), dense.n[cell],
              dense.mean_mm[cell], dense.sd_mm[cell]);
      for (const std::vector<double>& mode : dense.modes_mm) {
        csv.Add(mode[cell]);
      }
      csv.EndRow();
    }
  }
  return csv.Text();
}

Json ScoresJson(const PredictedSites& way) {
  const DepthScores& s = way.scores;
  return {{"points", s.points},
          {"mae_mm", s.mae_mm},
          {"rmse_mm", s.rmse_mm},
          {"bias_mm", s.bias_mm},
          {"crps_mm", s.crps_mm},
          {"log_score", s.log_score},
          {"interval_score_90_mm", s.interval_score_90_mm},
          {"coverage_50", s.coverage_50},
          {"coverage_90", s.coverage_90},
          {"coverage_95", s.coverage_95},
          {"mean_sd_mm", s.mean_sd_mm},
          {"mae_less_mean_mm",
           {{"subjects", way.against_mean_mm.n},
            {"mean", way.against_mean_mm.mean},
            {"low_95", way.against_mean_mm.mean_95.low},
            {"high_95", way.against_mean_mm.mean_95.high}}}};
}

Json SummaryJson(const PopulationResult& result) {
  Json json = {{"title", result.file.title},
               {"id", result.file.id},
               {"version", SEMBLANCE_VERSION},
               {"subjects",
                {{"all", result.subjects.size()},
                 {"measured", result.Count("done")},
                 {"failed", result.Count("failed")},
                 {"missing", result.Count("missing")},
                 {"counted", result.counted.size()}}},
               {"shrinkage", result.joint.shrinkage},
               {"outliers", result.outliers.size()},
               {"leave_one_out", Json::object()},
               {"modes", Json::array()},
               {"notes", result.notes}};
  for (const PredictedSites& way : result.predictions) {
    json["leave_one_out"][way.name] = ScoresJson(way);
  }
  for (const double share : result.dense.share) {
    json["modes"].push_back({{"share", share}});
  }
  json["libraries"] = Json::object();
  for (const auto& [name, version] : LibraryVersions()) {
    json["libraries"][name] = version;
  }
  return json;
}

}  // namespace

int PopulationResult::Count(const std::string& status) const { return CountOf(subjects, status); }

bool PopulationResult::LooksForOutliers() const { return Count("done") >= kMinSubjectsForOutliers; }

std::string WhyNoTable(const PopulationPlan& plan, const std::vector<MeasuredSubject>& subjects) {
  const int done = CountOf(subjects, "done");
  return done >= kMinSubjects
             ? ""
             : fmt::format(
                   "{}: {} subjects are measured ({} failed, {} missing); a population "
                   "needs at least {}",
                   plan.file.title, done, CountOf(subjects, "failed"), CountOf(subjects, "missing"),
                   kMinSubjects);
}

PopulationResult AnalysePopulation(const PopulationPlan& plan,
                                   std::vector<MeasuredSubject> subjects) {
  if (const std::string why = WhyNoTable(plan, subjects); !why.empty()) {
    throw InputError(why);
  }
  PopulationResult result;
  result.file = plan.file;
  result.notes = plan.notes;
  result.subjects = std::move(subjects);
  for (std::size_t k = 0; k < result.subjects.size(); ++k) {
    if (result.subjects[k].status == "done") {
      result.counted.push_back(static_cast<int>(k));
    }
  }
  result.sample = MakeSample(Counted(result), result.file.least_confidence);
  result.joint = FitPopulation(result.sample, result.file.correlation, result.file.shrinkage);
  NoteUnsearchedOutliers(result);
  HandleOutliers(result);
  result.table = MakeTissueTable(result.file, result.sample, result.joint);
  result.predictions = LeaveOneOut(result.file, Counted(result), result.sample);
  result.dense = FindDenseModes(result);
  result.notes = CollectNotes(result);
  return result;
}

std::string PopulationText(const PopulationResult& result) {
  std::string text = fmt::format(
      "{} subjects: {} measured, {} failed, {} missing; {} counted, {} sites; {:.0f} % of "
      "correlations from the model\n{}\n",
      result.subjects.size(), result.Count("done"), result.Count("failed"), result.Count("missing"),
      result.counted.size(), result.table.rows.size(), 100 * result.joint.shrinkage,
      result.LooksForOutliers() ? fmt::format("{} outliers", result.outliers.size())
                                : "outliers not searched for");
  for (const PredictedSites& way : result.predictions) {
    text += ScoreLine(way);
  }
  for (std::size_t k = 0; k < result.dense.share.size(); ++k) {
    text += fmt::format("mode {}: {:.1f} % of the variance over the skull\n", k + 1,
                        100 * result.dense.share[k]);
  }
  return text;
}

void WritePopulation(const PopulationResult& result, OutputFolder& folder) {
  const DenseMesh mesh = MakeDenseMesh(result.dense);
  MeshAttributes attributes;
  attributes.scalars = {{"mean_mm", OnVertices(mesh, result.dense.mean_mm)},
                        {"sd_mm", OnVertices(mesh, result.dense.sd_mm)}};
  for (std::size_t k = 0; k < result.dense.modes_mm.size(); ++k) {
    attributes.scalars.push_back(
        {fmt::format("mode_{}_mm", k + 1), OnVertices(mesh, result.dense.modes_mm[k])});
  }
  // All contents are made before the first file is written, because making them can still fail.
  const std::vector<std::pair<const char*, std::string>> files = {
      {"table.yaml", "# SPDX-License-Identifier: GPL-3.0-or-later\n" + WriteConfig(result.table)},
      {"depths.csv", DepthsCsv(result)},
      {"subjects.csv", SubjectsCsv(result.subjects)},
      {"outliers.csv", OutliersCsv(result)},
      {"leave_one_out.csv", LeaveOneOutCsv(result)},
      {"dense.csv", DenseCsv(result.dense)},
      {"dense.ply", EncodeMesh(mesh.mesh, ".ply", attributes)},
      {"population.json", WithPlainTexts(SummaryJson(result)).dump(2) + "\n"},
      {"report.html", PopulationReport(result)}};
  for (const auto& [name, bytes] : files) {
    folder.Write(name, bytes);
  }
}

void WriteSubjects(const std::vector<MeasuredSubject>& subjects, OutputFolder& folder) {
  folder.Write("subjects.csv", SubjectsCsv(subjects));
}

}  // namespace semblance::problems
