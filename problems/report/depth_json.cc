// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/depth_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "problems/metrics/face_metrics_json.h"

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
  }
  return json;
}

struct RegionErrors {
  int count = 0;
  double absolute = 0, squares = 0;
};

Json RegionsToJson(const CrossValidation& result) {
  std::map<std::string, RegionErrors> regions;
  for (const LeftOut& out : result.left_out) {
    if (std::isfinite(out.error_mm)) {
      RegionErrors& region = regions[kFaceParts[FacePartOfSite(out.site)]];
      ++region.count;
      region.absolute += std::abs(out.error_mm);
      region.squares += out.error_mm * out.error_mm;
    }
  }
  Json json = Json::object();
  for (const auto& [name, region] : regions) {
    json[name] = {{"n", region.count},
                  {"rms_mm", std::sqrt(region.squares / region.count)},
                  {"mean_abs_mm", region.absolute / region.count}};
  }
  return json;
}

}  // namespace

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
          {"tips", SummaryToJson(comparison.tips)}};
}

Json CrossValidationToJson(const CrossValidation& result) {
  Json json = {{"n", result.left_out.size()},
               {"predicted", result.predicted},
               {"rms_mm", result.rms_mm},
               {"mean_signed_mm", result.mean_mm},
               {"mean_abs_mm", result.mean_absolute_mm},
               {"max_mm", result.most_mm},
               {"coverage_90", result.coverage_90},
               {"coverage", result.coverage},
               {"regions", RegionsToJson(result)},
               {"sites", Json::object()}};
  for (const LeftOut& out : result.left_out) {
    json["sites"][out.site] = out.error_mm;
  }
  return json;
}

}  // namespace semblance
