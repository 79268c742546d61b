// SPDX-License-Identifier: GPL-3.0-or-later
// A surface whose edges v = 0 and v = 1 are one place each: held together there.
#pragma once

#include <cstddef>
#include <span>

#include "fitting/parameters/sphere.h"
#include "fitting/plan/fit_result.h"

namespace semblance {

struct OwnedPoints;

// Adds points along v = 0 and v = 1, at the pole each: as many along an edge as half the root of
// the number of points, each of the points' mean weight. Evenly spread points get fewer towards a
// pole, and without these the edges would be where noise takes them. Returns how many it added.
std::size_t AddPolePoints(const Poles& poles, OwnedPoints& points);

// Takes what was added, the last ones, out of what is told of the points.
//   weights: of the others; or none.
void ForgetLastPoints(std::size_t added, std::span<const double> weights, FitResult& fit);

}  // namespace semblance
