// SPDX-License-Identifier: GPL-3.0-or-later
// One depth for the whole skull: what a scheme must beat.
#pragma once

#include <span>
#include <string_view>

#include "interp/dowels/depth_input.h"

namespace semblance {

struct Mean {
  static constexpr std::string_view kName = "mean";
};
template <class Visitor>
void Fields(Visitor&, Mean&) {}

// The mean depth of all dowels at every vertex, whatever way it faces; no sd_mm. Throws InputError
// as CheckDepthInput.
DepthField InterpolateDepth(const Mean& options, const DepthInput& input, const RunContext& run);

// mm; at least one dowel.
double MeanDepth(std::span<const Dowel> dowels);

}  // namespace semblance
