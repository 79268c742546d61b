// SPDX-License-Identifier: GPL-3.0-or-later
// Closed forms of the integral of an inverse power of the distance over a flat polygon.
#pragma once

#include <span>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

// An edge of a polygon relative to the foot of a point on the polygon's plane, in mm. The edge's
// line lies at `distance` from the foot along the edge's outward normal (negative if the foot lies
// beyond the line). The edge runs from `begin` to `end`, measured along the line from its point
// nearest to the foot, with the polygon on the left.
struct EdgeFromFoot {
  double distance = 0, begin = 0, end = 0;
};

// The integral over the polygon of |p - q|^-(n+2) dq in mm^-n, for a point p at `height` > 0 over
// its plane and n in 1..64. By the divergence theorem it is a sum over the edges of rational and
// arctangent terms. If the foot lies outside the polygon, these terms cancel: the relative accuracy
// falls to about 1e-16 (distance / height)^n.
double IntegrateInversePower(std::span<const EdgeFromFoot> edges, double height, int n);

// The integral over one edge of |p - q|^-n dq; n >= 2; mm^(1-n).
double IntegrateAlong(const EdgeFromFoot& edge, double height, int n);

}  // namespace semblance::surfaces
