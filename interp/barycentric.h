// SPDX-License-Identifier: GPL-3.0-or-later
// Barycentric depth of the thesis (2.2): dowel areas bounded by cutting planes, linear in each.
#pragma once

#include <array>
#include <string_view>

#include "interp/depth_input.h"

namespace semblance {

enum class AreaDistance { kPlane, kTriangle };
constexpr auto EnumNames(AreaDistance) {
  return std::to_array<std::string_view>({"plane", "triangle"});
}

struct Barycentric {
  static constexpr std::string_view kName = "barycentric";
  AreaDistance distance = AreaDistance::kTriangle;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, Barycentric& o) {
  visit(FieldInfo{.name = "distance",
                  .doc = "which area is nearest to a vertex inside several: by its triangle, or by "
                         "its unbounded plane as in the thesis (2.2), which can pick a far one"},
        o.distance);
  MaxAngleField(visit, o.max_angle_deg);
}

// A vertex is in an area if it lies inside the area's three cutting planes: through each edge,
// along the sum of its two dowels' directions, on the side of the third base. Of several areas the
// nearest counts, of equally near ones the first. The vertex is then projected to the area's plane
// from the point in which the cutting planes meet, or along their common direction if they do not
// meet in one, and the depth is barycentric there: always between the three depths.
//
// kOutside where a vertex is in no area, kNotFacing where it turns away from its area; both without
// depth. sd_mm is interpolated alike, as if the three deviated together; NaN if one of them has
// none.
//
// The depth is continuous across an edge at the edge itself, and on all of its cutting plane where
// the areas project alike, as with parallel directions; elsewhere it may jump, the more the further
// the bone lies from the bases' plane.
//
// Throws InputError as CheckDepthInput, if the network has no area, and if an area has no triangle
// or a cutting plane is degenerate.
DepthField InterpolateDepth(const Barycentric& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance
