// SPDX-License-Identifier: GPL-3.0-or-later
// Interpolates a few measured depths to a depth at every vertex of a skull. A new scheme needs an
// options struct, an overload of InterpolateDepth, and an entry in SingleScheme.
#pragma once

#include <cstddef>
#include <utility>
#include <variant>

#include "interp/schemes/depth_map.h"
#include "interp/schemes/external_scheme.h"
#include "interp/schemes/population_depth.h"
#include "interp/stacking/auto_scheme.h"
#include "interp/stacking/single_scheme.h"

namespace semblance::interp {

// All choices: the single schemes, the mixture of several, people's depths given the dowels, a map
// in place of a scheme, and a scheme of the caller.
template <class... Single>
std::variant<Single..., AutoScheme, PopulationDepth, DepthMap, ExternalScheme> WithTheRest(
    const std::variant<Single...>&);
using DepthScheme = decltype(WithTheRest(std::declval<SingleScheme>()));

// Interpolates the depths. At vertices with status kAssigned the depth is finite and within the
// range of the dowels' depths (without a scheme's `clamp`: above 0; for depth_map: the map's
// depth; for an external scheme: above 0). Elsewhere it is NaN, for an OutsideRule to fill. The
// result does not depend on run.threads, nor on the order of the dowels except for round-off.
// Throws InputError if the scheme cannot use the input, and Cancelled if stopped.
DepthField InterpolateDepth(const DepthScheme& scheme, const DepthInput& input,
                            const RunContext& run);

// Returns true if the scheme works along the skull's surface and needs its triangles.
bool NeedsSurface(const DepthScheme& scheme);

// Returns true if the scheme's mean is DepthInput::expected.
bool NeedsExpected(const DepthScheme& scheme);

// Returns true if the scheme needs a dowel network with at least one area.
bool NeedsNetwork(const DepthScheme& scheme);

// The smallest number of dowels at distinct places that the scheme needs; 1 for most schemes.
std::size_t FewestDowels(const DepthScheme& scheme);

}  // namespace semblance::interp
