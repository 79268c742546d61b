// SPDX-License-Identifier: GPL-3.0-or-later
// Where residuals are correlated, so that finer vertices would follow them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fitting/nested/leaf_sums.h"
#include "fitting/nested/nested_space.h"

namespace semblance {

// Of residuals e under the functions N of a level: sum |sum_i N_i e_i|^2 / sum N_i^2 |e_i|^2 - 1
// over some of the functions. Errors that do not know of each other give 0 on the mean, whatever
// their size and however it changes from place to place; a function whose coefficient is as large
// as its own standard error gives 1, where taking it is worth just what it costs; and a single
// gross error gives 0 too, for it agrees with nobody.
struct UnresolvedDetail {
  // By level: per patch of the level before, whether it should be overlaid for what the functions
  // of this level see; nothing of levels that were not looked at.
  std::vector<std::vector<char>> seen;
  int first = 1;  // that was looked at
  int Finest() const { return static_cast<int>(seen.size()) - 1; }
};

// Looks at the levels that the space does not have as a whole, up to `finest`. indices and
// residuals: of the points that were fitted.
UnresolvedDetail FindUnresolvedDetail(const NestedPoints& points, const NestedSpace& space,
                                      int finest, std::span<const std::uint32_t> indices,
                                      std::span<const NestedResidual> residuals);

// Overlays each patch of the space over which a finer level sees detail, one level at a time.
// Returns the number of vertices that became active.
int OverlayDetail(const UnresolvedDetail& detail, NestedSpace& space);

// Overlays each patch of a level that is there and has at least so many points for each of
// the patches that it would be split into.
int OverlayDense(const NestedPoints& points, int level, double points_per_patch,
                 NestedSpace& space);

}  // namespace semblance
