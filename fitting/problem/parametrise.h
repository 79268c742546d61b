// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) in [0,1] x [0,1] for scattered points.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// Those that are given, if there are any, else the plane's.
struct AutoParameters {
  static constexpr std::string_view kName = "auto";
};
template <class Visitor>
void Fields(Visitor&, AutoParameters&) {}

// Those that are given, with the ranges mapped to [0,1].
struct GivenParameters {
  static constexpr std::string_view kName = "given";
  std::array<double, 2> u_range = {0, 1};
  std::array<double, 2> v_range = {0, 1};
};
template <class Visitor>
void Fields(Visitor& visit, GivenParameters& o) {
  visit(FieldInfo{.name = "u_range", .doc = "what of the column u becomes 0 and 1"}, o.u_range);
  visit(FieldInfo{.name = "v_range", .doc = "what of the column v becomes 0 and 1"}, o.v_range);
}

// Orthogonal projection on a plane, for points that do not fold over it: on the plane of least
// squares, u along its longest direction; or on the plane across `normal`, u along the coordinate
// axis nearest to the plane (the first of equals).
struct PlaneParameters {
  static constexpr std::string_view kName = "plane";
  std::array<double, 3> normal = {0, 0, 0};
};
template <class Visitor>
void Fields(Visitor& visit, PlaneParameters& o) {
  visit(FieldInfo{.name = "normal",
                  .doc = "direction of the heights, such as [0, 0, 1] for a terrain; [0, 0, 0] "
                         "takes that in which the points spread least"},
        o.normal);
}

// Angle around an axis and height along it, for points that go round; u is the angle, closed.
struct CylinderParameters {
  static constexpr std::string_view kName = "cylinder";
  std::array<double, 3> axis = {0, 0, 0};
};
template <class Visitor>
void Fields(Visitor& visit, CylinderParameters& o) {
  visit(FieldInfo{.name = "axis",
                  .doc = "direction of v; [0, 0, 0] takes that principal axis of the points from "
                         "which their distances differ least"},
        o.axis);
}

using Parameters =
    std::variant<AutoParameters, GivenParameters, PlaneParameters, CylinderParameters>;

enum class ParameterSource { kGiven, kPlane, kCylinder };
constexpr auto EnumNames(ParameterSource) {
  return std::to_array<std::string_view>({"given", "plane", "cylinder"});
}

struct Parametrisation {
  std::vector<Vec2> uv;  // one per point, in [0,1] x [0,1]
  ParameterSource source = ParameterSource::kGiven;
};

// positions: mm. given_uv: one per point, or none. Throws InputError for no points, `given` without
// given_uv, a number of given_uv that is not that of the points, an empty range, given_uv outside
// of it, and points that span no plane or have no extent along the axis.
Parametrisation Parametrise(std::span<const Vec3> positions,
                            const Parameters& parameters = AutoParameters{},
                            std::span<const Vec2> given_uv = {});

}  // namespace semblance
