// SPDX-License-Identifier: GPL-3.0-or-later
// The areas of the dowel network as regions of space (thesis 2.2): finds the area of a point, and
// the point's barycentric coordinates in it.
#pragma once

#include <array>
#include <functional>
#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"

namespace semblance::interp {

enum class AreaDistance { kPlane, kTriangle };
constexpr auto EnumNames(AreaDistance) {
  return std::to_array<std::string_view>({"plane", "triangle"});
}

// The common option of all schemes on the network.
template <class Visitor>
void AreaDistanceField(Visitor& visit, AreaDistance& distance) {
  visit(
      FieldInfo{
          .name = "distance",
          .doc =
              "distance that selects one of several areas around a vertex: to the area's triangle, "
              "or to its unbounded plane as in the thesis (2.2), which can select a distant area"},
      distance);
}

// An area with its three cutting planes. The function inside_k(p) = inside.row(k) . p + offset[k]
// is 0 on the cutting plane opposite corner k and 1 at corner k.
//
// The three values give the projection of p onto the bases' plane without the planes' common point
// p_c. They vanish at p_c, so that p = p_c + sum_k inside_k(p) (base_k - p_c). Hence the line from
// p_c through p meets the bases' plane at the barycentric coordinates inside_k(p) / sum. If the
// planes have a common direction instead of a point, moving along it changes no inside_k and the
// sum is 1, so that the same formula holds. No test against zero is needed, and no accuracy is lost
// near that case.
struct DowelArea {
  std::array<int, 3> dowels;
  std::array<Vec3, 3> base;
  Mat3 inside;
  Vec3 offset;
  Vec3 unit_normal;
  Vec3 mean_direction;  // unit
};

// Makes one area per area of the network, in order. Throws InputError, with the scheme's name, if
// the network has no area, an area's bases are collinear, or a cutting plane is degenerate.
std::vector<DowelArea> DowelAreas(std::string_view scheme, const DepthInput& input);

// Finds the area of a point. A point is in an area if it lies inside the three cutting planes. A
// cutting plane runs through an edge, along the sum of the directions of the edge's two dowels. If
// several areas contain the point, the nearest is returned; on a tie, the first.
struct AreaPoint {
  const DowelArea* area = nullptr;  // null: in no area
  Vec3 weights = Vec3::Zero();      // barycentric coordinates of the projection, >= 0
};
AreaPoint FindArea(const std::vector<DowelArea>& areas, AreaDistance distance, const Vec3& p);

// Makes the field of a scheme on the network. A vertex p in an area gets depth_at(point, p) if its
// normal is within max_angle_deg of the area's mean direction, and kNotFacing otherwise; other
// vertices get kOutside. sd_mm is the barycentric mean of the dowels' sd, which assumes that their
// errors are fully correlated; NaN if a dowel has none.
DepthField AssignInAreas(const std::vector<DowelArea>& areas, AreaDistance distance,
                         double max_angle_deg, const DepthInput& input, const RunContext& run,
                         const std::function<double(const AreaPoint&, const Vec3&)>& depth_at);

}  // namespace semblance::interp
