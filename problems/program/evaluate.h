// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance evaluate`: a face against the true skin, without a run.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "problems/metrics/face_region.h"
#include "surfaces/base/run_context.h"

namespace semblance {

struct EvaluateOptions {
  std::filesystem::path face;          // mesh, or a run's face.hspline.json
  std::filesystem::path truth;         // mesh of the skin; empty: that of the configuration
  std::filesystem::path config;        // of an experiment: its subject, landmarks and region
  std::vector<std::string> overrides;  // of the configuration
  std::filesystem::path landmarks;     // of the truth's skull, where there is no configuration
  std::vector<ExcludedZone> exclude;   // likewise
};

// What result.json says under `face`, to the bit if face.hspline.json and the configuration of the
// run are given. With neither configuration nor landmarks all of the truth is scored, as it is
// unknown what of it is the face. Throws InputError for files or options that do not go together;
// as Run does for the configuration; IoError.
nlohmann::ordered_json Evaluate(const EvaluateOptions& options, const RunContext& context);

// "zy_r=15", a site and a radius in mm. Throws InputError for another form.
ExcludedZone ParseZone(const std::string& text);

}  // namespace semblance
