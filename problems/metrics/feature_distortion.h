// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit did to the generic face's eyes, nose and mouth.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fitting/terms/metric_distortion.h"
#include "problems/face_template/template_face.h"

namespace semblance {

struct FeatureDistortion {
  std::string part;  // a feature of the template; `features`: all of them; `elsewhere`: the rest
  MetricDistortion distortion;
};

// Of each feature that has a region, of all regions together and of what lies outside them. placed:
// the generic face before the fit, regions and all in its frame; fitted: of the same shape.
std::vector<FeatureDistortion> MeasureFeatures(const TemplateFace& placed,
                                               const HSplineSurface& fitted);

// {part: {"rms_strain", "max_strain", "rms_area", "area_cm2"}}.
nlohmann::ordered_json FeaturesToJson(const std::vector<FeatureDistortion>& features);

}  // namespace semblance
