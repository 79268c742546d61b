// SPDX-License-Identifier: GPL-3.0-or-later
// Cross-validation: predictions of a scheme at left-out dowels.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel_network.h"
#include "interp/evaluation/scores.h"
#include "interp/interpolate_depth.h"
#include "interp/schemes/outside_rule.h"
#include "interp/stacking/leave_out.h"

namespace semblance::interp {

// One fold per landmark, with its left and right site (suffixes _l and _r) together, because a
// left-out dowel could be predicted from its twin.
Folds EachLandmark(std::span<const Dowel> dowels);
// A fold of all left dowels and a fold of all right dowels, to predict one half of a face from the
// other. A side with no dowel, or with all dowels, gives no fold.
Folds EachSide(std::span<const Dowel> dowels);
// `count` folds of nearly equal size (at most one per dowel), drawn from random_seed. The folds do
// not depend on the order of the dowels. Throws InputError for a count below 2.
Folds RandomFolds(std::span<const Dowel> dowels, int count, std::uint64_t random_seed);

struct LeftOut {
  std::string site;
  double depth_mm = kNaN;      // measured
  double predicted_mm = kNaN;  // prediction at its base without it; NaN if scheme and rule give
                               // none
  double error_mm = kNaN;      // predicted minus measured
  double sd_mm = kNaN;         // the scheme's own sd, or SdByDistance from the other folds
  double nearest_mm = kNaN;    // from its base to the nearest remaining dowel
  DepthStatus status = DepthStatus::kOutside;  // kAssigned: predicted by the scheme, otherwise by
                                               // the rule
  std::optional<bool> within_90;  // true if |error| <= 1.645 sd_mm; empty without error or sd
};

// Results and means over the dowels with a prediction; NaN without any.
struct CrossValidation {
  std::vector<LeftOut> left_out;  // in order of the folds
  int predicted = 0;
  double rms_mm = kNaN;
  double mean_mm = kNaN;  // > 0: predictions too thick
  double mean_absolute_mm = kNaN;
  double most_mm = kNaN;         // largest absolute error
  std::vector<double> coverage;  // Coverage() of dowels with sd_mm
  double coverage_90 = kNaN;     // its value at 90 %; 0.9 if the sd is correct
  DepthScores scores;            // of the scheme's own predictions
  DepthScores scores_with_rule;  // including the outside rule's predictions
  bool own_sd = false;           // true if the scheme states an sd above 0 somewhere
  SdByDistance sd;               // learned from all folds
};

// Leaves out each fold in turn (LeaveOut in stacking/leave_out.h). If the scheme states no sd above
// 0 at any dowel, the sd of a fold is learned from the errors in the other folds (SdByDistance). A
// scheme that only passes on the dowels' sd states 0 everywhere if all dowels are exact, which is
// not a statement about the bone between them. Throws as LeaveOut does.
CrossValidation CrossValidate(const DepthScheme& scheme, const OutsideRule& rule,
                              const DepthInput& input, const Folds& folds, const RunContext& run);

// Sets sd_mm at each vertex with a depth from known.sd and the distance to the nearest dowel,
// unless the scheme states its own sd.
DepthField WithStatedSd(DepthField field, const CrossValidation& known, const DepthInput& input,
                        const RunContext& run);

}  // namespace semblance::interp
