// SPDX-License-Identifier: GPL-3.0-or-later
// The areas of the dowel network as regions of space (thesis 2.2): which one a point belongs to,
// and where in it.
#pragma once

#include <array>
#include <functional>
#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"

namespace semblance {

enum class AreaDistance { kPlane, kTriangle };
constexpr auto EnumNames(AreaDistance) {
  return std::to_array<std::string_view>({"plane", "triangle"});
}

// The option behind it: alike for all schemes on the network.
template <class Visitor>
void AreaDistanceField(Visitor& visit, AreaDistance& distance) {
  visit(FieldInfo{.name = "distance",
                  .doc = "which area is nearest to a vertex inside several: by its triangle, or by "
                         "its unbounded plane as in the thesis (2.2), which can pick a far one"},
        distance);
}

// Row k of `inside` is the cutting plane opposite corner k: 0 on the plane, 1 at corner k.
//
// These three values give the projection without the centre p_c: all three vanish in p_c, so p =
// p_c
// + sum_k inside_k(p) (base_k - p_c), and the line from p_c through p meets the plane of the bases
// at the barycentric coordinates inside_k(p) / sum. If the planes have a common direction instead
// (det M = 0), going along it changes no inside_k and the sum is 1: the same formula, so nothing
// has to be tested against zero and nothing is lost near it.
struct DowelArea {
  std::array<int, 3> dowels;
  std::array<Vec3, 3> base;
  Mat3 inside;
  Vec3 offset;
  Vec3 unit_normal;
  Vec3 mean_direction;  // unit
};

// One per area of the network, in its order. Throws InputError, naming the scheme, if the network
// has no area, and if an area has no triangle or a cutting plane is degenerate.
std::vector<DowelArea> DowelAreas(std::string_view scheme, const DepthInput& input);

// A point is in an area if it lies inside the area's three cutting planes: through each edge, along
// the sum of its two dowels' directions, on the side of the third base. Of several areas the
// nearest counts, of equally near ones the first.
struct AreaPoint {
  const DowelArea* area = nullptr;  // none: in no area
  Vec3 weights = Vec3::Zero();      // barycentric, >= 0, of the point's projection
};
AreaPoint FindArea(const std::vector<DowelArea>& areas, AreaDistance distance, const Vec3& p);

// The field of a scheme on the network: depth_at(point, p) where p is in an area and its normal is
// within max_angle_deg of the area's mean direction, kNotFacing or kOutside elsewhere. sd_mm is
// barycentric, as if the three dowels deviated together; NaN if one of them has none.
DepthField AssignInAreas(const std::vector<DowelArea>& areas, AreaDistance distance,
                         double max_angle_deg, const DepthInput& input, const RunContext& run,
                         const std::function<double(const AreaPoint&, const Vec3&)>& depth_at);

}  // namespace semblance
