// SPDX-License-Identifier: GPL-3.0-or-later
// The JSON of results: result.json of a run, its parts for other jobs, and timing.json. A number
// that does not exist (NaN, infinity) is null.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "interp/evaluation/cross_validation.h"
#include "interp/evaluation/scores.h"
#include "problems/experiment/depth_comparison.h"
#include "problems/experiment/experiment.h"
#include "problems/experiment/step_clock.h"
#include "problems/run.h"

namespace semblance::problems {

// result.json of a run: its metrics and counts.
nlohmann::ordered_json ResultJson(const Experiment& experiment, const RunResult& result);

// The RMS distance of the depth markers' tips from the closest point of the recovered face; NaN
// without depths. (fit.dowel_rms_mm is that to each marker's own (u,v), from where the surface may
// have slid along itself.)
double MarkerRms_mm(const RunResult& result);

// n, stated, certain, the errors, the proper scores (an infinite log_score is null), coverage_50,
// _90, _95, mean_sd_mm and pit.
nlohmann::ordered_json ScoresToJson(const DepthScores& scores);

// Counts of vertices by status, range and mean of the assigned depths, dowels and areas. An average
// of schemes adds shares{}, kriging adds process{}.
nlohmann::ordered_json DepthToJson(const DepthField& depth, const Case& subject);

// along_direction{...} and closest{...}: each a distance summary with regions{}, coverage_90, the
// counts of scored vertices by the status of the truth, and scores{all{}, scheme{}} over everything
// that is scored and over the vertices that the scheme itself predicts. variogram{...}: of the
// truth along the direction, with its model and bins[]. tips{...}.
nlohmann::ordered_json ComparisonToJson(const DepthComparison& comparison);

// The summary, coverage_90, scores{all{}, scheme{}}, regions{}, and sites{} with the error of each
// left-out dowel.
nlohmann::ordered_json CrossValidationToJson(const CrossValidation& result);

// {"levels": [...], "relaxations": [...]}. "relaxations" is missing without relaxation.
nlohmann::ordered_json StepsToJson(const FitResult& fit);

// The word for the dowel's role in a dowels.csv: "landmark" or "inserted".
std::string RoleName(const Dowel& dowel);

// timing.json of a run, a depth study, a fit of points or a trial:
//   {"total_wall_s", "cpu_s": sums over the steps,
//    "steps": [{"step": name, "wall_s", "cpu_s", "peak_mb"}, ...] in the order in which they ran}
// A step that took its result from another job counts only what it did itself.
std::string TimingJson(const std::vector<StepTime>& times);

}  // namespace semblance::problems
