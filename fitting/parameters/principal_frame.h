// SPDX-License-Identifier: GPL-3.0-or-later
// Mean and principal directions of points.
#pragma once

#include <span>

#include "surfaces/base/geometry.h"

namespace semblance {

Vec3 MeanPoint(std::span<const Vec3> points);

// Columns: principal directions, the shortest first; each with its largest entry positive, so that
// no sign is left to chance.
struct PrincipalFrame {
  Vec3 mean;
  Mat3 axes;
  Vec3 spreads;  // mean squares along them, ascending
};

PrincipalFrame PrincipalFrameOf(std::span<const Vec3> points);

}  // namespace semblance
