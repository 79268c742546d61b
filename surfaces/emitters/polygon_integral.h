// SPDX-License-Identifier: GPL-3.0-or-later
// The integral of an inverse power of the distance over a flat polygon, in closed form.
#pragma once

#include <span>

namespace semblance {

// An edge of a polygon as seen from the foot of a point on the polygon's plane: the line of the
// edge lies `distance` away along the edge's outward normal (negative if the foot is beyond it),
// and the edge runs along it, polygon to the left, from `begin` to `end`, measured from the point
// of the line nearest to the foot. mm.
struct EdgeFromFoot {
  double distance = 0, begin = 0, end = 0;
};

// The integral over the polygon of |p - q|^-(n+2) dq, for a point p at `height` > 0 over its plane;
// n in 1..64; mm^-n. By the divergence theorem it is a sum over the edges of rational and
// arctangent terms. Where the foot lies outside, those cancel: relative accuracy falls to about
// 1e-16 times the n-th power of distance over height. Throws nothing.
double IntegrateInversePower(std::span<const EdgeFromFoot> edges, double height, int n);

// The integral over one edge of |p - q|^-n dq; n >= 2; mm^(1-n).
double IntegrateAlong(const EdgeFromFoot& edge, double height, int n);

}  // namespace semblance
