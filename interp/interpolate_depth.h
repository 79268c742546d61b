// SPDX-License-Identifier: GPL-3.0-or-later
// From a few depths to a depth at every vertex of a skull. A new scheme is one options struct with
// its overload of InterpolateDepth in a file of its own, and one entry of the variant.
#pragma once

#include <variant>

#include "interp/kriging/kriging.h"
#include "interp/kriging/surface_matern.h"
#include "interp/schemes/barycentric.h"
#include "interp/schemes/biharmonic.h"
#include "interp/schemes/depth_map.h"
#include "interp/schemes/harmonic.h"
#include "interp/schemes/inverse_distance.h"
#include "interp/schemes/mean.h"
#include "interp/schemes/moving_least_squares.h"
#include "interp/schemes/natural_neighbour.h"
#include "interp/schemes/nearest.h"
#include "interp/schemes/network_spline.h"
#include "interp/schemes/radial_basis.h"

namespace semblance {

using DepthScheme = std::variant<Barycentric, Nearest, Mean, InverseDistance, RadialBasis,
                                 MovingLeastSquares, Kriging, SurfaceMatern, Harmonic, Biharmonic,
                                 NaturalNeighbour, NetworkSpline, DepthMap>;

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

}  // namespace semblance
