// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/feature_distortion.h"

#include <algorithm>

namespace semblance {

std::vector<FeatureDistortion> MeasureFeatures(const TemplateFace& placed,
                                               const HSplineSurface& fitted) {
  std::vector<FeatureDistortion> parts;
  for (const TemplateFeature& feature : placed.features) {
    if (feature.region) {
      const auto inside = [&](const Vec3& p) { return feature.region->Contains(p); };
      parts.push_back({feature.name, MeasureDistortion(fitted, placed.surface, inside)});
    }
  }
  const auto inside = [&](const Vec3& p) {
    return std::any_of(placed.features.begin(), placed.features.end(),
                       [&](const auto& f) { return f.region && f.region->Contains(p); });
  };
  const auto outside = [&](const Vec3& p) { return !inside(p); };
  parts.push_back({"features", MeasureDistortion(fitted, placed.surface, inside)});
  parts.push_back({"elsewhere", MeasureDistortion(fitted, placed.surface, outside)});
  return parts;
}

nlohmann::ordered_json FeaturesToJson(const std::vector<FeatureDistortion>& features) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const FeatureDistortion& f : features) {
    json[f.part] = {{"rms_strain", f.distortion.rms_strain},
                    {"max_strain", f.distortion.max_strain},
                    {"rms_area", f.distortion.rms_area},
                    {"area_cm2", f.distortion.area_cm2}};
  }
  return json;
}

}  // namespace semblance
