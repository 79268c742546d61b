// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance evaluate`: compares a face with the true skin, without a run.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "problems/experiment/metrics/face_region.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

struct EvaluateOptions {
  std::filesystem::path face;    // mesh, or a run's face.hspline.json
  std::filesystem::path truth;   // mesh of the skin; empty: the skin of the configuration
  std::filesystem::path config;  // experiment with subject, landmarks and region; may be empty
  std::vector<std::string> overrides;  // of the configuration
  std::filesystem::path landmarks;     // on the true skull; only without a configuration
  std::vector<ExcludedZone> exclude;   // not scored; only without a configuration
};

// Returns the entry `face` of result.json. For the face.hspline.json and the configuration of a run
// the numbers are identical to those of the run. Without configuration and landmarks the whole
// truth is scored, because the region of the face is unknown. Throws InputError for files or
// options that cannot be combined, IoError, and as Run does for the configuration. `notes` receives
// remarks on the files, a line each.
nlohmann::ordered_json Evaluate(const EvaluateOptions& options, const RunContext& context,
                                std::vector<std::string>& notes);

// Parses a site and a radius in mm, e.g. "zy_r=15". Throws InputError for any other form.
ExcludedZone ParseZone(const std::string& text);

}  // namespace semblance::problems
