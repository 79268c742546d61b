// SPDX-License-Identifier: GPL-3.0-or-later
// Schemes on the areas of the dowel network: barycentric interpolation (thesis 2.2) and a smooth
// spline without the creases at the areas' edges.
#pragma once

#include <string_view>

#include "interp/dowels/dowel_area.h"
#include "interp/dowels/dowel_samples.h"

namespace semblance::interp {

// The thesis's scheme (2.2): the depth is linear in each dowel area.
struct Barycentric {
  static constexpr std::string_view kName = "barycentric";
  AreaDistance distance = AreaDistance::kTriangle;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, Barycentric& o) {
  AreaDistanceField(visit, o.distance);
  MaxAngleField(visit, o.max_angle_deg);
}

// A vertex in an area (FindArea) is projected onto the area's plane, from the common point of the
// cutting planes or along their common direction. The depth is the barycentric mean there, always
// between the three depths. Vertices in no area get kOutside, and vertices that turn away from
// their area get kNotFacing, both without depth. sd_mm as in AssignInAreas.
//
// The depth is continuous at a shared edge, and on the edge's whole cutting plane if both areas
// project alike, as with parallel directions. Elsewhere it may jump, the more the further the bone
// lies from the bases' plane. Throws InputError as CheckDepthInput and DowelAreas do.
DepthField InterpolateDepth(const Barycentric& options, const DepthInput& input,
                            const RunContext& run);

// A smooth depth on the dowel network, without barycentric's creases.
struct NetworkSpline {
  static constexpr std::string_view kName = "network_spline";
  AreaDistance distance = AreaDistance::kTriangle;
  bool clamp = true;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, NetworkSpline& o) {
  AreaDistanceField(visit, o.distance);
  ClampField(visit, o.clamp);
  MaxAngleField(visit, o.max_angle_deg);
}

// Nielson's minimum norm network (Math. Comp. 40, 1983), extended to space. Each dowel has a
// gradient in the plane perpendicular to its direction. The gradients minimise the bending of the
// cubics along all edges of the network (the integral of the squared second derivative). The
// gradients at an edge's ends extend its cubic to a function of space, which is the same for both
// areas at the edge. Inside an area the functions of the three edges are blended with the weights
// (w_i w_j)^2 / sum, where w are the barycentric coordinates of FindArea. On an edge only its own
// function counts, with its first derivatives.
//
// Hence depth and gradient are continuous across every edge and on the edge's whole cutting plane,
// also where the bone lies off the bases' plane. Every dowel is interpolated, and a linear depth on
// a plane is reproduced. `clamp` makes a crease where it cuts the depth off. If areas overlap
// without sharing an edge the depth may jump, as with barycentric.
//
// kOutside, kNotFacing and sd_mm as in AssignInAreas. Throws InputError as CheckDepthInput and
// DowelAreas do.
DepthField InterpolateDepth(const NetworkSpline& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance::interp
