// SPDX-License-Identifier: GPL-3.0-or-later
// The direction along which a vertex's depth is measured: the skin lies at p + depth * direction.
// The thesis (2.2) offers the skull's normal and interpolated dowel directions.
#pragma once

#include <string_view>
#include <variant>
#include <vector>

#include "interp/dowels/depth_input.h"

namespace semblance::interp {

// The mesh's normal at the vertex, which is as rough as the mesh.
struct MeshNormal {
  static constexpr std::string_view kName = "mesh_normal";
};
template <class Visitor>
void Fields(Visitor&, MeshNormal&) {}

// The area-weighted mean of the normals of the vertices within a radius. Normals more than 90
// degrees from the vertex's own are left out, so that the inner side of a thin wall has no
// influence.
struct SmoothedNormal {
  static constexpr std::string_view kName = "smoothed_normal";
  double radius_mm = 5;
};
template <class Visitor>
void Fields(Visitor& visit, SmoothedNormal& o) {
  visit(FieldInfo{.name = "radius_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 100,
                  .doc = "radius of the sphere in which normals are averaged; more is smoother and "
                         "rounds off rims"},
        o.radius_mm);
}

// The barycentric mean of the dowels' directions in the vertex's dowel area. Outside the network,
// and where the directions cancel, the mesh's normal.
struct DowelDirection {
  static constexpr std::string_view kName = "dowel_direction";
};
template <class Visitor>
void Fields(Visitor&, DowelDirection&) {}

using DepthDirection = std::variant<MeshNormal, SmoothedNormal, DowelDirection>;

// Computes one unit direction per vertex; zero if the mesh has no normal there and no dowel area
// applies. Throws InputError as CheckDepthInput does and, for dowel_direction, as DowelAreas does;
// Cancelled if stopped.
std::vector<Vec3> DepthDirections(const DepthDirection& direction, const DepthInput& input,
                                  const RunContext& run);

}  // namespace semblance::interp
