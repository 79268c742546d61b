// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/depth_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "problems/metrics/face_metrics.h"
#include "problems/subject/sites.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

int CountStatus(const DepthField& field, DepthStatus status) {
  return static_cast<int>(std::count(field.status.begin(), field.status.end(), status));
}

Json ErrorsToJson(const DepthErrors& errors) {
  Json json = SummaryToJson(errors.all);
  json["coverage_90"] = errors.coverage_90;
  json["coverage"] = errors.coverage;
  json["scores"] = {{"all", ScoresToJson(errors.scores)},
                    {"scheme", ScoresToJson(errors.scheme_scores)}};
  const auto count = [&](TruthStatus status) {
    const auto it = errors.vertices.find(status);
    return it == errors.vertices.end() ? 0 : it->second;
  };
  json["vertices"] = {
      {"valid", count(TruthStatus::kValid)},     {"no_direction", count(TruthStatus::kNoDirection)},
      {"no_hit", count(TruthStatus::kNoHit)},    {"too_far", count(TruthStatus::kTooFar)},
      {"grazing", count(TruthStatus::kGrazing)}, {"behind", count(TruthStatus::kBehind)}};
  json["regions"] = Json::object();
  for (const auto& [name, summary] : errors.regions) {
    json["regions"][name] = SummaryToJson(summary);
    json["regions"][name]["scores"] = ScoresToJson(errors.region_scores.at(name));
  }
  return json;
}

// Those of the part of the face; the outside rule's too.
DepthScores ScoresIn(const std::string& part, const CrossValidation& result) {
  std::vector<double> errors_mm, sds_mm;
  for (const LeftOut& out : result.left_out) {
    // A dowel of the experiment's own belongs to no part.
    if (IsStandardSite(out.site) && kFaceParts[FacePartOfSite(out.site)] == part) {
      errors_mm.push_back(out.error_mm);
      sds_mm.push_back(out.sd_mm);
    }
  }
  return ScoreDepths(errors_mm, sds_mm);
}

Json RegionsToJson(const CrossValidation& result) {
  Json json = Json::object();
  for (const std::string part : kFaceParts) {
    if (const DepthScores scores = ScoresIn(part, result); scores.points > 0) {
      json[part] = {{"n", scores.points},
                    {"rms_mm", scores.rmse_mm},
                    {"mean_abs_mm", scores.mae_mm},
                    {"scores", ScoresToJson(scores)}};
    }
  }
  return json;
}

Json VariogramToJson(const DepthComparison& comparison) {
  const VariogramModel& model = comparison.variogram_model;
  Json json = {{"nugget_mm2", model.nugget_mm2},
               {"sill_mm2", model.sill_mm2},
               {"length_mm", model.length_mm},
               {"bins", Json::array()}};
  for (const VariogramBin& bin : comparison.variogram) {
    json["bins"].push_back({{"distance_mm", bin.distance_mm},
                            {"semivariance_mm2", bin.semivariance_mm2},
                            {"pairs", bin.pairs}});
  }
  return json;
}

}  // namespace

Json ScoresToJson(const DepthScores& s) {
  return {{"n", s.points},
          {"stated", s.stated},
          {"certain", s.certain},
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
          {"pit", s.pit}};
}

Json DepthToJson(const DepthField& depth, const Case& subject) {
  std::vector<double> assigned;
  for (std::size_t v = 0; v < depth.depth_mm.size(); ++v) {
    if (depth.status[v] == DepthStatus::kAssigned) {
      assigned.push_back(depth.depth_mm[v]);
    }
  }
  Json json = {{"vertices", depth.depth_mm.size()},
               {"assigned", CountStatus(depth, DepthStatus::kAssigned)},
               {"outside", CountStatus(depth, DepthStatus::kOutside)},
               {"not_facing", CountStatus(depth, DepthStatus::kNotFacing)},
               {"min_mm", nullptr},
               {"mean_mm", nullptr},
               {"max_mm", nullptr},
               {"dowels", subject.dowels_on_bone.size()},
               {"areas", subject.network.areas.size()}};
  if (depth.process) {
    json["process"] = {{"length_mm", depth.process->length_mm},
                       {"signal_mm", depth.process->signal_mm},
                       {"nugget_mm", depth.process->nugget_mm},
                       {"mean_mm", depth.process->mean_mm}};
  }
  for (const SchemeShare& share : depth.shares) {
    json["shares"][share.scheme] = share.weight;
  }
  if (!assigned.empty()) {
    json["min_mm"] = *std::min_element(assigned.begin(), assigned.end());
    json["mean_mm"] = std::accumulate(assigned.begin(), assigned.end(), 0.0) /
                      static_cast<double>(assigned.size());
    json["max_mm"] = *std::max_element(assigned.begin(), assigned.end());
  }
  return json;
}

Json ComparisonToJson(const DepthComparison& comparison) {
  return {{"along_direction", ErrorsToJson(comparison.along_direction)},
          {"closest", ErrorsToJson(comparison.closest)},
          {"variogram", VariogramToJson(comparison)},
          {"tips", SummaryToJson(comparison.tips)}};
}

Json CrossValidationToJson(const CrossValidation& result) {
  Json json = {
      {"n", result.left_out.size()},
      {"predicted", result.predicted},
      {"rms_mm", result.rms_mm},
      {"mean_signed_mm", result.mean_mm},
      {"mean_abs_mm", result.mean_absolute_mm},
      {"max_mm", result.most_mm},
      {"coverage_90", result.coverage_90},
      {"coverage", result.coverage},
      {"own_sd", result.own_sd},
      {"scores",
       {{"all", ScoresToJson(result.scores_with_rule)}, {"scheme", ScoresToJson(result.scores)}}},
      {"regions", RegionsToJson(result)},
      {"sites", Json::object()}};
  for (const LeftOut& out : result.left_out) {
    json["sites"][out.site] = out.error_mm;
  }
  return json;
}

}  // namespace semblance
