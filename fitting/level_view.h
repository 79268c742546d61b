// SPDX-License-Identifier: GPL-3.0-or-later
// A level of a whole surface as the problem that its solve sees.
#pragma once

#include "fitting/fit_target.h"
#include "fitting/level_fit.h"
#include "surfaces/hspline_surface.h"

namespace semblance {

// The level as it stands, with the points of the target in their order; what finer levels add at a
// point is taken off it. rest: the placed template, of the same shape. Throws InputError for a
// level that the surface does not have, another shape, or a target as CheckTarget.
LevelView ViewOfLevel(const HSplineSurface& surface, const HSplineSurface& rest,
                      const FitTarget& target, int level);

}  // namespace semblance
