// SPDX-License-Identifier: GPL-3.0-or-later
// A start surface for a fit without a template.
#pragma once

#include <span>

#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// Makes a smooth surface near the points, with level 0 alone. It is the least-squares fit by linear
// combinations of
//   1, u, v                                (open), or
//   {1, cos 2 pi u, sin 2 pi u} x {1, v}   (closed in u).
// positions: mm; uv: in [0,1] x [0,1], one per position. Throws InputError if there are no points
// or the numbers differ, and like CheckShape for the shape.
HSplineSurface StartSurface(const HSplineShape& shape, std::span<const Vec3> positions,
                            std::span<const Vec2> uv);

}  // namespace semblance::fitting
