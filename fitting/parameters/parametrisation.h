// SPDX-License-Identifier: GPL-3.0-or-later
// Scattered points, and the (u,v) that were found for them.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/parameters/one_to_one.h"
#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_shape.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// What messages call a point, by its index; empty: "point 1" and so on.
using PointNames = std::function<std::string(std::size_t)>;

// Points of a file.
struct Scan {
  std::span<const Vec3> positions;           // mm
  std::span<const Vec2> given_uv = {};       // one per point, or none
  std::span<const Triangle> triangles = {};  // between the points, or none
  Closure closure = Closure::kOpen;          // of the surface that is wanted
  PointNames name_of = {};                   // of a point, where it was read
};

enum class ParameterSource { kGiven, kPlane, kCylinder, kMesh };
constexpr auto EnumNames(ParameterSource) {
  return std::to_array<std::string_view>({"given", "plane", "cylinder", "mesh"});
}

struct Parametrisation {
  std::vector<Vec2> uv;  // one per point, in [0,1] x [0,1]
  ParameterSource source = ParameterSource::kGiven;
  std::string how = {};   // in words: which plane, axis or map; empty of given ones
  MapFaults faults = {};  // of what was chosen; none of given ones, which are not looked at
};

}  // namespace semblance
