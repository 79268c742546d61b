// SPDX-License-Identifier: GPL-3.0-or-later
// Predictions of a scheme at dowels that are left out, and a standard deviation learned from their
// errors.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "interp/dowels/dowel_network.h"
#include "interp/schemes/outside_rule.h"
#include "interp/stacking/single_scheme.h"
#include "surfaces/base/geometry.h"

namespace semblance::interp {

// The properties of a scheme that LeaveOut needs.
struct Interpolator {
  std::function<DepthField(const DepthInput&, const RunContext&)> interpolate;
  // Predicts all folds at once, with one field per fold and one entry per dowel of the fold. Empty
  // if the scheme has no method that is cheaper than one solve per fold.
  std::function<std::vector<DepthField>(const DepthInput&, const Folds&, const RunContext&)>
      left_out;
  bool needs_surface = false;
  bool needs_network = false;
  std::size_t fewest_dowels = 1;  // at distinct places
};

Interpolator MakeInterpolator(const SingleScheme& scheme);

// Predicts left-out dowels: one field per fold, with one entry per dowel of the fold at its base,
// for bone that faces along the dowel's direction, after the outside rule. A scheme on the surface
// without `left_out` is solved on the whole skull once per fold; the prediction is its depth at the
// nearest corner of the closest triangle. If a fold leaves a scheme on the network without an area,
// or too few dowels for a mean's factors, only the rule predicts. Folds run on run.threads threads;
// the result does not depend on their number. Throws InputError as CheckDepthInput does, if a fold
// names a missing dowel or leaves none, and as the scheme does without the fold's dowels; Cancelled
// if stopped.
std::vector<DepthField> LeaveOut(const Interpolator& scheme, const OutsideRule& rule,
                                 const DepthInput& input, const Folds& folds,
                                 const RunContext& run);

// A standard deviation for schemes that state none: sd_mm = scale_mm sqrt(distance / distance_mm),
// where the distance to the nearest dowel is limited to 0.1 to 2 times distance_mm. This is the law
// of a rough field, whose squared differences grow with the distance.
struct SdByDistance {
  double scale_mm = kNaN;
  double distance_mm = kNaN;  // mean distance of the training errors

  double At(double to_nearest_mm) const;  // NaN without a fit
};

// Fits the scale so that half of the errors lie within 0.674 sd. This median is robust against a
// few large errors at the rim. errors_mm: predicted minus true; distances_mm: from each dowel to
// the nearest remaining one. Pairs with a value that is not finite are ignored. NaN for fewer than
// three pairs.
SdByDistance FitSdByDistance(std::span<const double> errors_mm,
                             std::span<const double> distances_mm);

}  // namespace semblance::interp
