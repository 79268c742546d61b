// SPDX-License-Identifier: GPL-3.0-or-later
// How well a scheme predicts dowels that it is not shown.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "interp/dowels/left_out_dowels.h"
#include "interp/evaluation/scores.h"
#include "interp/interpolate_depth.h"
#include "interp/schemes/outside_rule.h"
#include "interp/stacking/sd_by_distance.h"

namespace semblance {

// A site's left and right (suffixes _l and _r) together: its twin tells much of a left-out dowel.
Folds EachLandmark(std::span<const Dowel> dowels);
// All left dowels, then all right ones: what half a face tells of the other. Sides that have no
// dowel, or all of them, give no fold.
Folds EachSide(std::span<const Dowel> dowels);
// `count` folds as equal in size as can be (at most one per dowel), drawn from random_seed; which
// dowel is in which does not depend on their order. Throws InputError for a count below 2.
Folds RandomFolds(std::span<const Dowel> dowels, int count, std::uint64_t random_seed);

struct LeftOut {
  std::string site;
  double depth_mm = kNaN;      // the dowel's
  double predicted_mm = kNaN;  // at its base, without it; NaN where scheme and rule give none
  double error_mm = kNaN;      // predicted less the dowel's
  double sd_mm = kNaN;         // the scheme's own there; else by distance, from the other folds
  double nearest_mm = kNaN;    // from its base to the nearest dowel that was shown
  DepthStatus status = DepthStatus::kOutside;  // kAssigned: the scheme's; else the rule's
  std::optional<bool> within_90;  // is |error| at most 1.645 sd_mm? none without error or sd
};

// Means over those with a prediction; NaN where there is none.
struct CrossValidation {
  std::vector<LeftOut> left_out;  // in the order of the folds
  int predicted = 0;
  double rms_mm = kNaN;
  double mean_mm = kNaN;  // above 0: predicted too thick
  double mean_absolute_mm = kNaN;
  double most_mm = kNaN;         // largest absolute error
  std::vector<double> coverage;  // of those with a stated sd_mm (calibration.h)
  double coverage_90 = kNaN;     // its share at 90 %; 0.9 where the sd is true
  DepthScores scores;            // where the scheme itself answers
  DepthScores scores_with_rule;  // and where the outside rule does
  bool own_sd = false;           // does the scheme state an sd of its own, above 0 somewhere?
  SdByDistance sd;               // learned from all folds; of a scheme without one
};

// Leaves each fold out, as LeaveOut (stacking/leave_out.h). Where the scheme states no sd_mm above
// 0 of its own at any dowel, that of a fold is learned from what was missed in the other folds
// (sd_by_distance.h): a scheme that hands on what the dowels have has 0 all over the bone where all
// of them are known exactly, and that is no word about the bone between them. Throws as LeaveOut.
CrossValidation CrossValidate(const DepthScheme& scheme, const OutsideRule& rule,
                              const DepthInput& input, const Folds& folds, const RunContext& run);

// The field with the sd_mm of `known` at each vertex with a depth, by the distance to the nearest
// dowel, where the scheme states none of its own; else as it is.
DepthField WithStatedSd(DepthField field, const CrossValidation& known, const DepthInput& input,
                        const RunContext& run);

}  // namespace semblance
