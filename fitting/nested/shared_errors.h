// SPDX-License-Identifier: GPL-3.0-or-later
// Statistics that show errors which points share: those of rounding, and those of neighbours. The
// fit smooths over both (nested_fit.cc); NestedWeightSearch::FindSharedErrors finds the latter.
#pragma once

#include <vector>

#include "fitting/nested/nested_solve.h"

namespace semblance::fitting {

// `outlier` holds a flag per point; flagged points do not count.

// The least mean square, in mm^2 along z, of the noise of heights that were rounded to a lattice;
// 0 for others. A surface with less noise follows the steps of the rounding.
double RoundingNoiseSquare(const NestedPoints& points);

// The mean square, in mm^2, of what the residuals of the last solution exceed half a step of the
// lattice by.
double MeanSquareBeyondRounding(NestedSolve& solve, const NestedPoints& points,
                                const std::vector<char>& outlier);

// The largest mean square of errors, in mm^2 along one axis, that count as shared: a part of that
// of the points' displacements. Larger ones may be the surface.
double MostSharedSquare(const NestedPoints& points, const std::vector<char>& outlier);

// Returns whether the residuals of the last solution are about as large in all parts of the domain:
// the median of their mean squares, over runs along the curve, is near the mean.
bool AreAlikeEverywhere(NestedSolve& solve, const NestedPoints& points,
                        const std::vector<char>& outlier);

}  // namespace semblance::fitting
