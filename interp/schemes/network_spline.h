// SPDX-License-Identifier: GPL-3.0-or-later
// A smooth depth on the dowel network: the thesis's areas without their creases.
#pragma once

#include <string_view>

#include "interp/dowels/dowel_area.h"
#include "interp/dowels/dowel_samples.h"

namespace semblance {

struct NetworkSpline {
  static constexpr std::string_view kName = "network_spline";
  AreaDistance distance = AreaDistance::kTriangle;  // as barycentric
  bool clamp = true;                                // to the dowels' range
  double max_angle_deg = 90;                        // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, NetworkSpline& o) {
  AreaDistanceField(visit, o.distance);
  ClampField(visit, o.clamp);
  MaxAngleField(visit, o.max_angle_deg);
}

// Nielson's minimum norm network (Math. Comp. 40, 1983), in space. Each dowel has a gradient in the
// plane across its direction; together they make the cubics along all edges of the network bend
// least, in the integral of the squared second derivative. An edge's cubic is carried off the edge
// by the gradients at its ends, which gives a function of space that is the same for both its
// areas; inside an area the three edges' functions are blended with weights (w_i w_j)^2 / sum of
// the barycentric coordinates w of `FindArea`, as Nielson's, so that on an edge its own function
// alone counts, with its first derivatives.
//
// So depth and its gradient are continuous across every edge and on all of the cutting plane
// through it, also where the bone lies off the bases' plane; every dowel is honoured; a depth
// linear on a plane is reproduced. What `clamp` cuts off has a crease at the cut. Where areas
// overlap without sharing an edge the depth may jump, as barycentric's.
//
// kOutside, kNotFacing and sd_mm as AssignInAreas. Throws InputError as CheckDepthInput and
// DowelAreas.
DepthField InterpolateDepth(const NetworkSpline& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance
