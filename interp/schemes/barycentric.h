// SPDX-License-Identifier: GPL-3.0-or-later
// Barycentric depth of the thesis (2.2): dowel areas bounded by cutting planes, linear in each.
#pragma once

#include <string_view>

#include "interp/dowels/dowel_area.h"

namespace semblance {

struct Barycentric {
  static constexpr std::string_view kName = "barycentric";
  AreaDistance distance = AreaDistance::kTriangle;  // the thesis's plane can pick a far area
  double max_angle_deg = 90;                        // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, Barycentric& o) {
  AreaDistanceField(visit, o.distance);
  MaxAngleField(visit, o.max_angle_deg);
}

// A vertex in an area (FindArea) is projected to the area's plane from the point in which the
// cutting planes meet, or along their common direction if they do not meet in one, and the depth is
// barycentric there: always between the three depths.
//
// kOutside where a vertex is in no area, kNotFacing where it turns away from its area; both without
// depth. sd_mm as AssignInAreas.
//
// The depth is continuous across an edge at the edge itself, and on all of its cutting plane where
// the areas project alike, as with parallel directions; elsewhere it may jump, the more the further
// the bone lies from the bases' plane.
//
// Throws InputError as CheckDepthInput and DowelAreas.
DepthField InterpolateDepth(const Barycentric& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance
