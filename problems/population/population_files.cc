// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "problems/config/config.h"
#include "problems/output/manifest.h"
#include "problems/population/dense_mesh.h"
#include "problems/population/population_report.h"
#include "surfaces/base/csv.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

const std::string& NameOf(const PopulationResult& result, int row) {
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
    const auto known = CovariatesOf({subject.person, subject.depths});
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
  for (const Foresight& way : result.foresights) {
    for (const PredictedDepth& depth : way.depths) {
      csv.Row(way.name, NameOf(result, depth.subject), depth.site, depth.depth_mm,
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

Json ScoresJson(const Foresight& way) {
  const DepthScores& s = way.scores;
  return {{"points", s.points},
          {"mae_mm", Number(s.mae_mm)},
          {"rmse_mm", Number(s.rmse_mm)},
          {"bias_mm", Number(s.bias_mm)},
          {"crps_mm", Number(s.crps_mm)},
          {"log_score", Number(s.log_score)},
          {"interval_score_90_mm", Number(s.interval_score_90_mm)},
          {"coverage_50", Number(s.coverage_50)},
          {"coverage_90", Number(s.coverage_90)},
          {"coverage_95", Number(s.coverage_95)},
          {"mean_sd_mm", Number(s.mean_sd_mm)},
          {"mae_less_mean_mm",
           {{"subjects", way.against_mean_mm.n},
            {"mean", Number(way.against_mean_mm.mean)},
            {"low_95", Number(way.against_mean_mm.mean_95.low)},
            {"high_95", Number(way.against_mean_mm.mean_95.high)}}}};
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
               {"shrinkage", Number(result.joint.shrinkage)},
               {"outliers", result.outliers.size()},
               {"leave_one_out", Json::object()},
               {"modes", Json::array()},
               {"notes", result.notes}};
  for (const Foresight& way : result.foresights) {
    json["leave_one_out"][way.name] = ScoresJson(way);
  }
  for (const double share : result.dense.share) {
    json["modes"].push_back({{"share", Number(share)}});
  }
  json["libraries"] = Json::object();
  for (const auto& [name, version] : LibraryVersions()) {
    json["libraries"][name] = version;
  }
  return json;
}

}  // namespace

void WritePopulation(const PopulationResult& result, OutputFolder& folder) {
  const DenseMesh mesh = MeshOf(result.dense);
  MeshAttributes attributes;
  attributes.scalars = {{"mean_mm", OnVertices(mesh, result.dense.mean_mm)},
                        {"sd_mm", OnVertices(mesh, result.dense.sd_mm)}};
  for (std::size_t k = 0; k < result.dense.modes_mm.size(); ++k) {
    attributes.scalars.push_back(
        {fmt::format("mode_{}_mm", k + 1), OnVertices(mesh, result.dense.modes_mm[k])});
  }
  // First what can still be refused.
  const std::vector<std::pair<const char*, std::string>> files = {
      {"table.yaml", "# SPDX-License-Identifier: GPL-3.0-or-later\n" + WriteConfig(result.table)},
      {"depths.csv", DepthsCsv(result)},
      {"subjects.csv", SubjectsCsv(result.subjects)},
      {"outliers.csv", OutliersCsv(result)},
      {"leave_one_out.csv", LeaveOneOutCsv(result)},
      {"dense.csv", DenseCsv(result.dense)},
      {"dense.ply", EncodeMesh(mesh.mesh, ".ply", attributes)},
      {"population.json", SummaryJson(result).dump(2) + "\n"},
      {"report.html", PopulationReport(result)}};
  for (const auto& [name, bytes] : files) {
    folder.Write(name, bytes);
  }
}

void WriteSubjects(const std::vector<MeasuredSubject>& subjects, OutputFolder& folder) {
  folder.Write("subjects.csv", SubjectsCsv(subjects));
}

}  // namespace semblance
