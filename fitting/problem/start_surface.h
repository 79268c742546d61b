// SPDX-License-Identifier: GPL-3.0-or-later
// A surface to start from where there is no template.
#pragma once

#include <span>

#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// A smooth surface near the points, with level 0 alone: the least-squares fit of all affine maps of
// (u,v) (open), or of all sums of 1, cos and sin of 2 pi u, each with and without v (closed in u).
//   positions: mm; uv: in [0,1] x [0,1], one per position.
// Throws InputError for no points, a number of uv that is not that of the points, and a shape as
// CheckShape does.
HSplineSurface StartSurface(const HSplineShape& shape, std::span<const Vec3> positions,
                            std::span<const Vec2> uv);

}  // namespace semblance
