// SPDX-License-Identifier: GPL-3.0-or-later
// The solution of a nested fit as an H-spline.
#pragma once

#include "fitting/nested/nested_points.h"
#include "fitting/nested/nested_solve.h"
#include "fitting/nested/nested_space.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// Returns the start plus the displacements, level by level, because an offset is measured from the
// next coarser surface. displacements: per level of the space, along the channels of the points.
HSplineSurface MakeSurface(const HSplineSurface& start, const NestedSpace& space,
                           const NestedPoints& points, const NestedValues& displacements);

}  // namespace semblance::fitting
