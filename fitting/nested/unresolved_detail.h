// SPDX-License-Identifier: GPL-3.0-or-later
// Detection of unresolved detail: correlated residuals that finer vertices would follow.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fitting/nested/leaf_sums.h"
#include "fitting/nested/nested_space.h"

namespace semblance::fitting {

// The test statistic for the functions N (B-splines) of a level and residuals e is
//
//   sum |sum_i N_i e_i|^2 / sum N_i^2 |e_i|^2 - 1,
//
// summed over the functions over a patch. Its expectation is 0 for independent errors, whatever
// their sizes. It is 1 for functions whose coefficients equal their standard errors, where adding
// them gains exactly what it costs. A single gross error gives 0, because no other residual agrees
// with it.
struct UnresolvedDetail {
  // Per level, and per patch of the next coarser level: whether functions of the level detect
  // detail over the patch. Empty for levels that were not tested.
  std::vector<std::vector<char>> seen;
  int first = 1;  // first tested level
  int Finest() const { return static_cast<int>(seen.size()) - 1; }
};

// Tests all levels up to `finest` that are not active as a whole. indices, residuals: those of the
// fitted points.
UnresolvedDetail FindUnresolvedDetail(const NestedPoints& points, const NestedSpace& space,
                                      int finest, std::span<const std::uint32_t> indices,
                                      std::span<const NestedResidual> residuals);

// Overlays each patch of the space over which some finer level detects detail, with vertices of the
// next level. Returns the number of newly active vertices.
int OverlayDetail(const UnresolvedDetail& detail, NestedSpace& space);

// Overlays each patch of a level that is present and has at least points_per_patch points for each
// of its four children. Returns the number of newly active vertices.
int OverlayDense(const NestedPoints& points, int level, double points_per_patch,
                 NestedSpace& space);

}  // namespace semblance::fitting
