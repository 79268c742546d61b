// SPDX-License-Identifier: GPL-3.0-or-later
// The test bench of interpolation schemes: the depth of an experiment without implicit face or fit,
// compared with the true depth and by cross-validation.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "interp/evaluation/cross_validation.h"
#include "problems/experiment/depth_comparison.h"
#include "problems/io/output_folder.h"
#include "problems/report/pictures/colour_map.h"

namespace semblance::problems {

struct DepthResult {
  std::shared_ptr<const DepthStage> stage;
  // The depth of the stage. If the scheme states no sd_mm, it is learned from left-out landmarks.
  DepthField depth;
  std::vector<Vec3> directions;          // one per vertex of the shell
  std::optional<DepthComparison> truth;  // set if the true skin is known
  // By the dowels that are left out together: "landmark" (both sides of it), "side", "k_fold"
  // (random parts). A kind with too few dowels is missing; a depth_map has none.
  std::vector<std::pair<std::string, CrossValidation>> left_out;
  std::vector<StepTime> times;  // not part of the result proper

  // Reasons why the result is unusable; empty if it is usable.
  std::vector<std::string> Faults() const;
  bool usable() const { return Faults().empty(); }
};

// Loads the case, fills the skull, interpolates, leaves dowels out, and compares with the truth.
// Uses `cache` as Run does. Throws as LoadSubject does, and Cancelled.
DepthResult MeasureDepth(const Experiment& experiment, const RunContext& context,
                         StageCache* cache = nullptr);

// Metrics and counts: title, subject, usable, depth{}, depth_truth{}, cross_validation{}, notes[].
// A missing number is null, or NaN, which is written as null.
nlohmann::ordered_json DepthResultJson(const Experiment& experiment, const DepthResult& result);

// Writes one line per left-out dowel: kind, site, landmark, region, depth_mm, predicted_mm,
// error_mm, sd_mm, within_90, status. A missing value is an empty cell.
std::string LeftOutCsv(const DepthResult& result);

// Writes one line per dowel of the bone, in the columns of a run's dowels.csv without those of a
// fit.
std::string DepthDowelsCsv(const DepthResult& result);

// Draws, as PNG, the depth on the skull's shell from two sides and, if the truth is known, the
// error along the direction.
std::string DepthPicture(const DepthResult& result, int threads);
// The legends of that picture, for a page that shows it.
std::vector<Legend> DepthPictureLegends(bool has_truth);

// The files that WriteDepth writes.
inline constexpr std::array<std::string_view, 8> kDepthFiles = {
    "resolved.yaml", "result.json", "dowels.csv", "left_out.csv",
    "depth.ply",     "tips.ply",    "depth.png",  "timing.json"};

// Writes kDepthFiles. depth.ply has depth, sd, true depths and errors per vertex; tips.ply is the
// shell moved by its depth.
void WriteDepth(const Experiment& experiment, const DepthResult& result, OutputFolder& folder,
                const RunContext& context);

// Writes the main numbers as a few lines of text for people.
std::string DepthText(const DepthResult& result);

}  // namespace semblance::problems
