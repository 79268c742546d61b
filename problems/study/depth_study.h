// SPDX-License-Identifier: GPL-3.0-or-later
// The bench of interpolation schemes: an experiment's depth alone, without an implicit face or a
// fit, against the true depth and by cross-validation.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "interp/evaluation/cross_validation.h"
#include "problems/output/files.h"
#include "problems/pictures/colour_map.h"
#include "problems/pipeline/depth_comparison.h"

namespace semblance {

struct DepthResult {
  std::shared_ptr<const DepthStage> stage;
  // The stage's; where the scheme states no sd_mm, with one learned from left-out landmarks.
  DepthField depth;
  std::vector<Vec3> directions;          // one per vertex of the shell
  std::optional<DepthComparison> truth;  // where the true skin is known
  // What was left out together: "landmark" (both its sides), "side", "k_fold" (random parts).
  // A kind for which there are not enough dowels is missing; all are of a depth_map.
  std::vector<std::pair<std::string, CrossValidation>> left_out;
  std::vector<StepTime> times;  // not part of the result proper

  // Why it cannot be used; empty if it can.
  std::vector<std::string> Faults() const;
  bool usable() const { return Faults().empty(); }
};

// Loads the case, fills the skull, interpolates, leaves dowels out, compares. Throws as
// LoadSubject, and Cancelled. cache: as Run's.
DepthResult MeasureDepth(const Experiment& experiment, const RunContext& context,
                         StageCache* cache = nullptr);

// Metrics and counts: title, subject, usable, depth{}, depth_truth{}, cross_validation{}, notes[];
// null, or NaN that is written as null, where there is not a number.
nlohmann::ordered_json DepthResultJson(const Experiment& experiment, const DepthResult& result);

// One line per left-out dowel: kind, site, landmark, region, depth_mm, predicted_mm, error_mm,
// sd_mm, within_90, status; an empty cell where there is none.
std::string LeftOutCsv(const DepthResult& result);

// The depth on the skull's shell from two sides and, where the truth is known, the error against it
// along the direction; as PNG.
std::string DepthPicture(const DepthResult& result, int threads);
// The legends of that picture, for a page that shows it.
std::vector<Legend> DepthPictureLegends(bool has_truth);

// What WriteDepth writes.
inline constexpr std::array<std::string_view, 7> kDepthFiles = {
    "resolved.yaml", "result.json", "left_out.csv", "depth.ply",
    "tips.ply",      "depth.png",   "timing.json"};

// resolved.yaml, result.json, left_out.csv, depth.ply (depth, sd, true depths and errors per
// vertex), tips.ply (the shell moved by its depth), depth.png, timing.json.
void WriteDepth(const Experiment& experiment, const DepthResult& result, OutputFolder& folder,
                const RunContext& context);

// The numbers for people: a few lines of text.
std::string DepthText(const DepthResult& result);

}  // namespace semblance
