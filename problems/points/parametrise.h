// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) for scattered points that have none, or have others than [0,1] x [0,1].
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "problems/points/point_table.h"
#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Those of the table where it has some, else the plane's.
struct AutoParameters {
  static constexpr std::string_view kName = "auto";
};
template <class Visitor>
void Fields(Visitor&, AutoParameters&) {}

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

// Orthogonal projection on the plane of least squares, u along its longest direction; or on that
// across a normal, u along the coordinate axis nearest to it, the first of equals. For points that
// do not fold over it.
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

struct Parametrisation {
  std::vector<Vec2> uv;  // one a point, in [0,1] x [0,1]
  std::string kind;      // given, plane or cylinder
};

// Throws InputError for `given` without columns u and v, an empty range, (u,v) outside of it, or
// points that span no plane or have no extent along the axis.
Parametrisation Parametrise(const PointTable& table, const Parameters& parameters);

// A smooth surface near the points to start from: of all affine maps of (u,v) (open), or of all
// sums of 1, cos, sin of 2 pi u, each with and without v (periodic), that of least squares.
HSplineSurface StartSurface(const HSplineShape& shape, std::span<const Vec3> positions,
                            std::span<const Vec2> uv);

}  // namespace semblance
