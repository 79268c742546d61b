// SPDX-License-Identifier: GPL-3.0-or-later
// Compares interpolated depths with the true ones of a subject whose skin is known.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "interp/evaluation/depth_truth.h"
#include "interp/evaluation/scores.h"
#include "interp/evaluation/variogram.h"
#include "problems/experiment/metrics/face_metrics.h"
#include "problems/experiment/skull_stage.h"

namespace semblance::problems {

// Errors against the truth of one convention. Positive: the interpolated depth is too large.
struct DepthErrors {
  DistanceSummary all;
  std::map<std::string, DistanceSummary> regions;  // by part of the face
  std::vector<double> error_mm;                    // one per vertex of the shell; NaN if not scored
  std::map<TruthStatus, int> vertices;  // numbers of scored vertices by status of the truth
  std::vector<double> coverage;  // by area, where sd_mm is known (interp/evaluation/calibration.h)
  double coverage_90 = kNaN;     // coverage of the 90 % interval
  DepthScores scores;            // by area, over all scored vertices
  DepthScores scheme_scores;     // over vertices whose depth is the scheme's own
  std::map<std::string, DepthScores> region_scores;  // over all, by part of the face
};

struct DepthComparison {
  FaceRegion region;             // of the shell's vertices, in front of the network of all sites
  std::vector<Vec3> directions;  // of the depths (Experiment::direction)
  DepthTruth truth;
  DepthErrors along_direction, closest;
  std::vector<VariogramBin> variogram;  // of the true depth along the direction, up to 60 mm
  VariogramModel variogram_model;       // fitted to it
  DistanceSummary tips;  // from p + depth * direction to the closest skin, with the same sign
};

// Compares the vertices of the region that have a valid truth and a finite depth, including depths
// of the outside rule. The subject must have a skin. depth: that of the stage, with the sd_mm that
// is to be scored. Throws InputError as InFrontOfNetwork and DepthDirections do, and Cancelled if
// stopped.
DepthComparison CompareDepths(const Experiment& experiment, const DepthStage& stage,
                              const DepthField& depth, const RunContext& context);

}  // namespace semblance::problems
