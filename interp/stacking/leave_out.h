// SPDX-License-Identifier: GPL-3.0-or-later
// What a scheme gives at dowels that it is not shown.
#pragma once

#include <functional>
#include <vector>

#include "interp/dowels/left_out_dowels.h"
#include "interp/schemes/outside_rule.h"
#include "interp/stacking/single_scheme.h"

namespace semblance {

// A scheme as leaving out sees it.
struct Interpolator {
  std::function<DepthField(const DepthInput&, const RunContext&)> interpolate;
  // All folds at once, one field a fold with an entry for each of its dowels, where the scheme has
  // a cheaper way than one solve a fold; may be empty.
  std::function<std::vector<DepthField>(const DepthInput&, const Folds&, const RunContext&)>
      left_out;
  bool needs_surface = false;
  bool needs_network = false;
  std::size_t fewest_dowels = 1;  // at places of their own
};

Interpolator InterpolatorOf(const SingleScheme& scheme);

// One field a fold, with an entry for each of its dowels at their bases, as if the bone there faced
// along the dowel's direction; after the outside rule. A scheme on the surface without a cheaper
// way is solved on all of the skull once a fold and asked at the nearest corner of the closest
// triangle. Where a scheme on the network is left without an area, or one with a mean of several
// factors with too few dowels, the rule alone answers. Folds on run.threads threads; no result
// depends on them. Throws InputError as CheckDepthInput, if a fold names a dowel that is not there
// or leaves none, and what the scheme throws without the fold's dowels; Cancelled if stopped.
std::vector<DepthField> LeaveOut(const Interpolator& scheme, const OutsideRule& rule,
                                 const DepthInput& input, const Folds& folds,
                                 const RunContext& run);

}  // namespace semblance
