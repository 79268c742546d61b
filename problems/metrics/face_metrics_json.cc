// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/face_metrics_json.h"

#include <nlohmann/json.hpp>

namespace semblance {

using Json = nlohmann::ordered_json;  // writes NaN as null

Json SummaryToJson(const DistanceSummary& s) {
  return {{"mean_abs_mm", s.mean_abs_mm},
          {"rms_mm", s.rms_mm},
          {"median_mm", s.median_mm},
          {"p95_mm", s.p95_mm},
          {"max_mm", s.max_mm},
          {"mean_signed_mm", s.mean_signed_mm},
          {"sd_mm", s.sd_mm},
          {"within_2_5mm", s.within_2_5mm},
          {"within_5mm", s.within_5mm},
          {"area_cm2", s.area_cm2}};
}

namespace {

void AddVolume(const EnclosedVolume& volume, Json& json) {
  json["enclosed_volume_cm3"] = volume.Enclosed();
  json["outside_volume_cm3"] = volume.outside_cm3;
  json["inside_volume_cm3"] = volume.inside_cm3;
}

Json RegionsToJson(const FaceMetrics& metrics) {
  Json json = Json::object();
  for (const auto& [name, summary] : metrics.regions) {
    json[name] = SummaryToJson(summary);
    const auto volume = metrics.region_volumes.find(name);
    AddVolume(volume == metrics.region_volumes.end() ? EnclosedVolume{} : volume->second,
              json[name]);
  }
  return json;
}

}  // namespace

Json MetricsToJson(const FaceMetrics& metrics) {
  Json json = SummaryToJson(metrics.truth_to_face);
  json["hausdorff_mm"] = metrics.hausdorff_mm;
  json["volume_between_cm3"] = metrics.volume_between_cm3;
  AddVolume(metrics.volume, json);
  json["normals"] = {{"mean_deg", metrics.normals.mean_deg},
                     {"median_deg", metrics.normals.median_deg},
                     {"p95_deg", metrics.normals.p95_deg}};
  json["quantiles_mm"] = metrics.quantiles_mm;
  json["reverse"] = SummaryToJson(metrics.face_to_truth);
  json["symmetric"] = SummaryToJson(metrics.symmetric);
  json["regions"] = RegionsToJson(metrics);
  return json;
}

}  // namespace semblance
