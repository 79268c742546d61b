// SPDX-License-Identifier: GPL-3.0-or-later
// How far an interpolated depth is from the true one, where the true skin is known.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "interp/evaluation/depth_truth.h"
#include "interp/evaluation/scores.h"
#include "interp/evaluation/variogram.h"
#include "problems/metrics/face_metrics.h"
#include "problems/pipeline/skull_stage.h"

namespace semblance {

// Against one convention's truth. Positive: the interpolated depth is too great.
struct DepthErrors {
  DistanceSummary all;
  std::map<std::string, DistanceSummary> regions;  // by part of the face
  std::vector<double> error_mm;         // one per vertex of the shell; NaN where not scored
  std::map<TruthStatus, int> vertices;  // of the scored region, by what the truth says
  std::vector<double>
      coverage;               // of the area with a stated sd_mm (interp/evaluation/calibration.h)
  double coverage_90 = kNaN;  // its share at 90 %
  DepthScores scores;         // by area, over all that is scored
  DepthScores scheme_scores;  // where the scheme itself gave the depth
  std::map<std::string, DepthScores> region_scores;  // over all, by part of the face
};

struct DepthComparison {
  FaceRegion region;             // of the shell's vertices: those before all sites' network
  std::vector<Vec3> directions;  // of the depths (Experiment::direction)
  DepthTruth truth;
  DepthErrors along_direction, closest;
  std::vector<VariogramBin> variogram;  // of the true depth along the direction, up to 60 mm
  VariogramModel variogram_model;       // fitted to it
  DistanceSummary tips;  // from p + depth * direction to the closest skin, signed as the above
};

// Over the vertices of the region where the depth is finite, also where the outside rule gave it,
// and the truth is valid. The subject must have a skin. Throws InputError as InFrontOfNetwork and
// DepthDirections; Cancelled if stopped.
// depth: of the stage, with such an sd_mm as is to be scored.
DepthComparison CompareDepths(const Experiment& experiment, const DepthStage& stage,
                              const DepthField& depth, const RunContext& context);

}  // namespace semblance
