// SPDX-License-Identifier: GPL-3.0-or-later
// The direction along which a vertex's depth is taken: the soft tissue lies at p + depth *
// direction (thesis 2.2, which offers the skull's normal and interpolated dowel directions).
#pragma once

#include <string_view>
#include <variant>
#include <vector>

#include "interp/dowels/depth_input.h"

namespace semblance {

// The mesh's normal at the vertex, as rough as the mesh.
struct MeshNormal {
  static constexpr std::string_view kName = "mesh_normal";
};
template <class Visitor>
void Fields(Visitor&, MeshNormal&) {}

// The mean of the mesh's normals at the vertices within a radius, each by the area it stands for;
// of those that face within 90 degrees of the vertex's own, so that the inner side of a thin wall
// has no say.
struct SmoothedNormal {
  static constexpr std::string_view kName = "smoothed_normal";
  double radius_mm = 5;  // of the sphere in which normals are averaged
};
template <class Visitor>
void Fields(Visitor& visit, SmoothedNormal& o) {
  visit(FieldInfo{.name = "radius_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 100,
                  .doc = "of the sphere in which the normals are averaged; more is smoother and "
                         "rounds rims off"},
        o.radius_mm);
}

// The dowels' directions, barycentric in the dowel area of the vertex (`barycentric`'s areas); the
// mesh's normal outside the network, and where the directions cancel.
struct DowelDirection {
  static constexpr std::string_view kName = "dowel_direction";
};
template <class Visitor>
void Fields(Visitor&, DowelDirection&) {}

using DepthDirection = std::variant<MeshNormal, SmoothedNormal, DowelDirection>;

// Unit, one per vertex; zero where the mesh has no normal (and no dowel area helps). Throws
// InputError as CheckDepthInput, and dowel_direction as DowelAreas; Cancelled if stopped.
std::vector<Vec3> DepthDirections(const DepthDirection& direction, const DepthInput& input,
                                  const RunContext& run);

}  // namespace semblance
