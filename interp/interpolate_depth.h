// SPDX-License-Identifier: GPL-3.0-or-later
// From a few depths to a depth at every vertex of a skull. A new scheme is one options struct with
// its overload of InterpolateDepth in a file of its own, and one entry of SingleScheme.
#pragma once

#include <cstddef>
#include <utility>
#include <variant>

#include "interp/schemes/depth_map.h"
#include "interp/stacking/auto_scheme.h"
#include "interp/stacking/single_scheme.h"

namespace semblance {

// Each scheme by itself, then what is made of several, and last what is no scheme.
template <class... Single>
std::variant<Single..., AutoScheme, DepthMap> WithTheRest(const std::variant<Single...>&);
using DepthScheme = decltype(WithTheRest(std::declval<SingleScheme>()));

// One entry per vertex. Where the status is kAssigned the depth is finite and within the range of
// the dowels' depths (without a scheme's `clamp`: above 0; depth_map's are the map's); elsewhere it
// is NaN, for an OutsideRule to fill. The result does not depend on run.threads nor on the order of
// the dowels (beyond rounding). Throws InputError where the scheme cannot use the input, Cancelled
// if stopped.
DepthField InterpolateDepth(const DepthScheme& scheme, const DepthInput& input,
                            const RunContext& run);

// Does the scheme work along the skull's surface, so that points alone do not do?
bool NeedsSurface(const DepthScheme& scheme);

// Does the scheme vary around DepthInput::expected?
bool NeedsExpected(const DepthScheme& scheme);

// Does the scheme work on the dowel network, so that one without an area will not do?
bool NeedsNetwork(const DepthScheme& scheme);

// The fewest dowels, at places of their own, with which the scheme can be asked: 1 of most.
std::size_t FewestDowels(const DepthScheme& scheme);

}  // namespace semblance
