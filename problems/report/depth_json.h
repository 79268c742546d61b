// SPDX-License-Identifier: GPL-3.0-or-later
// What is known of an interpolated depth as JSON, for result.json; null for NaN.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "interp/evaluation/cross_validation.h"
#include "interp/evaluation/scores.h"
#include "problems/pipeline/depth_comparison.h"

namespace semblance {

// n, stated, certain, the errors, the proper scores (an infinite log_score is null), coverage_50,
// _90, _95, mean_sd_mm and pit.
nlohmann::ordered_json ScoresToJson(const DepthScores& scores);

// Counts of vertices by status, range and mean of the assigned depths, dowels and areas; shares{}
// of an average of schemes, process{} of kriging.
nlohmann::ordered_json DepthToJson(const DepthField& depth, const Case& subject);

// along_direction{...}, closest{...}: each a distance summary with regions{}, coverage_90, the
// counts of scored vertices by what the truth says there, and scores{all{}, scheme{}}: of all that
// is scored, and where the scheme itself answers; variogram{...} of the truth along the direction,
// with its model and bins[]; tips{...}.
nlohmann::ordered_json ComparisonToJson(const DepthComparison& comparison);

// The summary, coverage_90, scores{all{}, scheme{}}, regions{} and sites{}: the error of each
// left-out dowel.
nlohmann::ordered_json CrossValidationToJson(const CrossValidation& result);

}  // namespace semblance
