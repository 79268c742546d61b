// SPDX-License-Identifier: GPL-3.0-or-later
// How well a scheme predicts dowels that it is not shown.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "interp/interpolate_depth.h"
#include "interp/schemes/outside_rule.h"

namespace semblance {

// Indices of dowels that are left out together.
using Folds = std::vector<std::vector<std::size_t>>;

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
  double sd_mm = kNaN;         // that the scheme states there; NaN where it states none
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
};

// Leaves each fold out, with the network's areas at its dowels, and asks at the left-out bases, as
// if the bone there faced along the dowel's direction. Schemes that need the skull's surface are
// solved on all of it once per fold and asked at the nearest corner of the closest triangle. Where
// a scheme on the network is left without an area, the rule alone answers. Folds on run.threads
// threads; no result depends on them. Throws InputError as CheckDepthInput, if a fold names a dowel
// that is not there or leaves none, and what the scheme throws without the fold's dowels; Cancelled
// if stopped.
CrossValidation CrossValidate(const DepthScheme& scheme, const OutsideRule& rule,
                              const DepthInput& input, const Folds& folds, const RunContext& run);

}  // namespace semblance
