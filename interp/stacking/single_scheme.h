// SPDX-License-Identifier: GPL-3.0-or-later
// The schemes that make a depth from dowels by themselves: what `auto` chooses among. A new one is
// one entry here.
#pragma once

#include <cstddef>
#include <variant>

#include "interp/kriging/kriging.h"
#include "interp/kriging/surface_matern.h"
#include "interp/schemes/barycentric.h"
#include "interp/schemes/biharmonic.h"
#include "interp/schemes/harmonic.h"
#include "interp/schemes/inverse_distance.h"
#include "interp/schemes/mean.h"
#include "interp/schemes/moving_least_squares.h"
#include "interp/schemes/natural_neighbour.h"
#include "interp/schemes/nearest.h"
#include "interp/schemes/network_spline.h"
#include "interp/schemes/radial_basis.h"

namespace semblance {

using SingleScheme =
    std::variant<Barycentric, Nearest, Mean, InverseDistance, RadialBasis, MovingLeastSquares,
                 Kriging, SurfaceMatern, Harmonic, Biharmonic, NaturalNeighbour, NetworkSpline>;

// Does the scheme work along the skull's surface, so that points alone do not do?
bool SingleNeedsSurface(const SingleScheme& scheme);

// Does the scheme vary around DepthInput::expected?
bool SingleNeedsExpected(const SingleScheme& scheme);

// Does the scheme work on the dowel network, so that one without an area will not do?
bool SingleNeedsNetwork(const SingleScheme& scheme);

// The fewest dowels, at places of their own, with which the scheme can be asked: 1 of most.
std::size_t SingleFewestDowels(const SingleScheme& scheme);

}  // namespace semblance
