// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) in [0,1] x [0,1] for scattered points.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fitting/problem/mesh_map.h"
#include "fitting/problem/one_to_one.h"
#include "fitting/problem/sphere.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_shape.h"

namespace semblance {

// The parameters that are given, if there are any. Otherwise those of a torus for a surface that
// goes round both ways, of a cylinder for one that goes round in u, and of a plane for an open one.
// What goes round in u and closes at both ends of the cylinder gets those of a sphere, unless it
// folds over that. Where every plane folds and there are triangles, the mesh is laid out.
struct AutoParameters {
  static constexpr std::string_view kName = "auto";
};
template <class Visitor>
void Fields(Visitor&, AutoParameters&) {}

// What becomes of a plane, cylinder, sphere or torus over which the points fold.
enum class FoldRule { kRefuse, kAccept };
constexpr auto EnumNames(FoldRule) { return std::to_array<std::string_view>({"refuse", "accept"}); }
template <class Visitor>
void FoldField(Visitor& visit, FoldRule& folds) {
  visit(FieldInfo{.name = "folds",
                  .doc = "what becomes of points that fold over it, more than 2 % of them: refuse "
                         "them; or accept it: the surface then goes between the sheets"},
        folds);
}

// Those that are given, with the ranges mapped to [0,1].
struct GivenParameters {
  static constexpr std::string_view kName = "given";
  std::array<double, 2> u_range = {0, 1};  // what becomes 0 and 1
  std::array<double, 2> v_range = {0, 1};  // likewise
};
template <class Visitor>
void Fields(Visitor& visit, GivenParameters& o) {
  visit(FieldInfo{.name = "u_range", .doc = "what of the column u becomes 0 and 1"}, o.u_range);
  visit(FieldInfo{.name = "v_range", .doc = "what of the column v becomes 0 and 1"}, o.v_range);
}

// Orthogonal projection on a plane, for points that do not fold over it: on the plane of least
// squares, u along its longest direction, or, where they fold over that, on the plane across z, y
// or x over which they fold least; or on the plane across `normal`, u along the coordinate axis
// nearest to the plane (the first of equals).
struct PlaneParameters {
  static constexpr std::string_view kName = "plane";
  std::array<double, 3> normal = {0, 0, 0};  // of the heights; 0: found from the points
  FoldRule folds = FoldRule::kRefuse;        // of points that lie over each other
};
template <class Visitor>
void Fields(Visitor& visit, PlaneParameters& o) {
  visit(FieldInfo{.name = "normal",
                  .doc = "direction of the heights, such as [0, 0, 1] for a terrain; [0, 0, 0] "
                         "takes that in which the points spread least, or, where they fold over "
                         "it, z, y or x"},
        o.normal);
  FoldField(visit, o.folds);
}

// Angle around an axis and height along it, for points that go round; u is the angle, closed.
struct CylinderParameters {
  static constexpr std::string_view kName = "cylinder";
  std::array<double, 3> axis = {0, 0, 0};  // along v; 0: found from the points
  FoldRule folds = FoldRule::kRefuse;      // of points that lie over each other
};
template <class Visitor>
void Fields(Visitor& visit, CylinderParameters& o) {
  visit(FieldInfo{.name = "axis",
                  .doc = "direction of v; [0, 0, 0] takes that principal axis of the points from "
                         "which their distances differ least, or, where they fold over its "
                         "cylinder, that over which they fold least"},
        o.axis);
  FoldField(visit, o.folds);
}

// Azimuth around an axis, closed, and angle from the pole at its foot over pi, for closed surfaces
// that every ray from the centre of the sphere nearest to the points (sphere.h) meets once. At
// either pole an edge of the domain is one place.
struct SphereParameters {
  static constexpr std::string_view kName = "sphere";
  std::array<double, 3> axis = {0, 0, 0};  // from pole to pole; 0: found from the points
  FoldRule folds = FoldRule::kRefuse;      // of points that lie over each other
};
template <class Visitor>
void Fields(Visitor& visit, SphereParameters& o) {
  visit(FieldInfo{.name = "axis",
                  .doc = "direction of v, from the pole v = 0 to the pole v = 1; [0, 0, 0] takes "
                         "that in which the points spread most, or, of flat ones, least"},
        o.axis);
  FoldField(visit, o.folds);
}

// Angles around an axis and around the ring's circle about it, for points that go round both ways;
// the ring and its tube are those of the torus nearest to the points (torus.h).
struct TorusParameters {
  static constexpr std::string_view kName = "torus";
  std::array<double, 3> axis = {0, 0, 0};  // that u goes round; 0: found from the points
  FoldRule folds = FoldRule::kRefuse;      // of points that lie over each other
};
template <class Visitor>
void Fields(Visitor& visit, TorusParameters& o) {
  visit(FieldInfo{.name = "axis",
                  .doc = "direction that u goes round; [0, 0, 0] takes that of the torus nearest "
                         "to the points"},
        o.axis);
  FoldField(visit, o.folds);
}

// The triangles between the points, laid out on the plane (mesh_map.h); u and v along its sides.
struct MeshParameters {
  static constexpr std::string_view kName = "mesh";
  MeshMap map = MeshMap::kLscm;  // of the triangles to the plane
};
template <class Visitor>
void Fields(Visitor& visit, MeshParameters& o) {
  visit(FieldInfo{.name = "map",
                  .doc = "lscm: angles kept, with a free border; arap: as rigid as possible, with "
                         "a free border, slow; mean_value: the border on a square, which never "
                         "folds; tutte: the same with uniform weights; auto: arap, or mean_value "
                         "where that folds"},
        o.map);
}

using Parameters =
    std::variant<AutoParameters, GivenParameters, PlaneParameters, CylinderParameters,
                 SphereParameters, TorusParameters, MeshParameters>;

enum class ParameterSource { kGiven, kPlane, kCylinder, kSphere, kTorus, kMesh };
constexpr auto EnumNames(ParameterSource) {
  return std::to_array<std::string_view>({"given", "plane", "cylinder", "sphere", "torus", "mesh"});
}

struct Parametrisation {
  std::vector<Vec2> uv;  // one per point, in [0,1] x [0,1]
  ParameterSource source = ParameterSource::kGiven;
  std::string how = {};   // in words: which plane, axis or map; empty of given ones
  MapFaults faults = {};  // of what was chosen; none of given ones, which are not looked at
  std::optional<Poles> poles = {};  // of a sphere
};

// What messages call a point, by its index; empty: "point 1" and so on.
using PointNames = std::function<std::string(std::size_t)>;

// Points of a file.
struct Scan {
  std::span<const Vec3> positions;           // mm
  std::span<const Vec2> given_uv = {};       // one per point, or none
  std::span<const Triangle> triangles = {};  // between the points, or none
  Closure closure = Closure::kOpen;          // of the surface that is wanted, for AutoParameters
  PointNames name_of = {};                   // of a point, where it was read
};

// `given` in the memory of the (u,v). Throws InputError as Parametrise does.
Parametrisation TakeGiven(std::vector<Vec2> given_uv, const GivenParameters& given,
                          const PointNames& name_of = {});

// du x dv looks where the triangles look. Whatever is chosen is one-to-one, but for given (u,v) and
// where folds are accepted: the points are looked at (one_to_one.h), and the triangles if there are
// any. Throws InputError for no points, `given` without given_uv, a number of given_uv that is not
// that of the points, an empty range, given_uv outside of it, points that span no plane or have no
// extent along the axis, points that are no torus, close at an end of the cylinder, do not go all
// round the sphere's centre, or fold over every plane, cylinder, sphere or torus that may be taken,
// `mesh` without triangles, a corner that is no point, and as LayOut.
Parametrisation Parametrise(const Scan& scan, const Parameters& parameters = AutoParameters{});
Parametrisation Parametrise(std::span<const Vec3> positions,
                            const Parameters& parameters = AutoParameters{},
                            std::span<const Vec2> given_uv = {});

}  // namespace semblance
