// SPDX-License-Identifier: GPL-3.0-or-later
// The schemes that compute depths from dowels, among which `auto` chooses. A new scheme adds one
// entry here.
#pragma once

#include <cstddef>
#include <variant>

#include "interp/kriging/kriging.h"
#include "interp/kriging/surface_matern.h"
#include "interp/schemes/harmonic.h"
#include "interp/schemes/moving_least_squares.h"
#include "interp/schemes/natural_neighbour.h"
#include "interp/schemes/network_schemes.h"
#include "interp/schemes/radial_basis.h"
#include "interp/schemes/simple_schemes.h"

namespace semblance::interp {

using SingleScheme =
    std::variant<Barycentric, Nearest, Mean, InverseDistance, RadialBasis, MovingLeastSquares,
                 Kriging, SurfaceMatern, Harmonic, Biharmonic, NaturalNeighbour, NetworkSpline>;

// Returns true if the scheme works along the skull's surface and needs its triangles.
bool SingleNeedsSurface(const SingleScheme& scheme);

// Returns true if the scheme's mean is DepthInput::expected.
bool SingleNeedsExpected(const SingleScheme& scheme);

// Returns true if the scheme needs a dowel network with at least one area.
bool SingleNeedsNetwork(const SingleScheme& scheme);

// The smallest number of dowels at distinct places that the scheme needs; 1 for most schemes.
std::size_t SingleFewestDowels(const SingleScheme& scheme);

}  // namespace semblance::interp
