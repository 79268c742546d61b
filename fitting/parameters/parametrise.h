// SPDX-License-Identifier: GPL-3.0-or-later
// Parameters (u,v) in [0,1] x [0,1] for scattered points: read from the file, or found by a plane,
// a cylinder, or a mesh that is laid out.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fitting/folds/fold_check.h"
#include "fitting/parameters/mesh_map.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_shape.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::fitting {

// The treatment of points that fold over a plane or a cylinder.
enum class FoldRule { kRefuse, kAccept };
constexpr auto EnumNames(FoldRule) { return std::to_array<std::string_view>({"refuse", "accept"}); }
template <class Visitor>
void FoldField(Visitor& visit, FoldRule& folds) {
  visit(FieldInfo{.name = "folds",
                  .doc = "refuse: points of which more than 2 % fold over it are an error; accept: "
                         "they are fitted, and the surface lies between the sheets"},
        folds);
}

// The (u,v) of the file, with the ranges mapped to [0,1].
struct GivenParameters {
  static constexpr std::string_view kName = "given";
  std::array<double, 2> u_range = {0, 1};
  std::array<double, 2> v_range = {0, 1};
  FoldRule folds = FoldRule::kRefuse;
};
template <class Visitor>
void Fields(Visitor& visit, GivenParameters& o) {
  visit(FieldInfo{.name = "u_range", .doc = "values of the column u that become 0 and 1"},
        o.u_range);
  visit(FieldInfo{.name = "v_range", .doc = "values of the column v that become 0 and 1"},
        o.v_range);
  visit(FieldInfo{.name = "folds",
                  .doc = "refuse: (u,v) that bring several sheets to a tenth of the places are an "
                         "error; accept: they are fitted, and the surface lies between the sheets"},
        o.folds);
}

// Orthogonal projection on a plane: along z, if the points are heights over x and y, and otherwise
// on the plane of least squares, for height fields in any pose. On a given normal's plane u runs
// along the coordinate axis that is nearest to the plane (the first of equals); on the plane of
// least squares u runs along its longest direction.
struct PlaneParameters {
  static constexpr std::string_view kName = "plane";
  std::array<double, 3> normal = {0, 0, 0};
  FoldRule folds = FoldRule::kRefuse;
};
template <class Visitor>
void Fields(Visitor& visit, PlaneParameters& o) {
  visit(FieldInfo{.name = "normal",
                  .doc = "direction of the heights, such as [0, 0, 1] for a terrain; [0, 0, 0] "
                         "takes z, unless the points fold over x and y, then the direction in "
                         "which they spread least, or, where they fold over its plane, the best of "
                         "that, y and x"},
        o.normal);
  FoldField(visit, o.folds);
}

// Angle around an axis (u) and height along it (v), for points that go round, or are bent round the
// axis but for a sector (closure: open).
struct CylinderParameters {
  static constexpr std::string_view kName = "cylinder";
  std::array<double, 3> axis = {0, 0, 0};
  FoldRule folds = FoldRule::kRefuse;
};
template <class Visitor>
void Fields(Visitor& visit, CylinderParameters& o) {
  visit(FieldInfo{.name = "axis",
                  .doc = "direction of v; [0, 0, 0] takes the principal axis of the points from "
                         "which their distances differ least, or, where they fold over its "
                         "cylinder, the principal axis over whose cylinder they fold least; for an "
                         "open sheet, the direction across its normals"},
        o.axis);
  FoldField(visit, o.folds);
}

// The triangles between the points, laid out on the plane (mesh_map.h), with u and v along its
// sides.
struct MeshParameters {
  static constexpr std::string_view kName = "mesh";
  MeshMap map = MeshMap::kLscm;
};
template <class Visitor>
void Fields(Visitor& visit, MeshParameters& o) {
  visit(
      FieldInfo{.name = "map",
                .doc = "lscm: keeps angles, with a free border; arap: as rigid as possible, with a "
                       "free border, slow; mean_value: the border on a square, which never folds; "
                       "tutte: the same with uniform weights; auto: arap, or mean_value where arap "
                       "folds"},
      o.map);
}

// The first of these that applies: `given`, if the file has (u,v); `cylinder`, if the surface goes
// round in u; `mesh`, if the file has triangles and the points fold over every plane; else `plane`.
struct AutoParameters {
  static constexpr std::string_view kName = "auto";
};
template <class Visitor>
void Fields(Visitor&, AutoParameters&) {}

using Parameters = std::variant<AutoParameters, GivenParameters, PlaneParameters,
                                CylinderParameters, MeshParameters>;

// Returns the name of a point in messages, from its index, such as "scan.csv:110: point 109". An
// empty function stands for "point 1" and so on.
using PointNames = std::function<std::string(std::size_t)>;

// The points of a file.
struct Scan {
  std::span<const Vec3> positions;           // mm
  std::vector<Vec2> given_uv = {};           // one per point, or none
  std::span<const Triangle> triangles = {};  // between the points, or none
  Closure closure = Closure::kOpen;          // of the wanted surface
  PointNames name_of = {};
  bool has_map_columns = false;  // named as a map's: z is a height
};

enum class ParameterSource { kGiven, kPlane, kCylinder, kMesh };
constexpr auto EnumNames(ParameterSource) {
  return std::to_array<std::string_view>({"given", "plane", "cylinder", "mesh"});
}

struct Parametrisation {
  std::vector<Vec2> uv;  // one per point, in [0,1] x [0,1]
  ParameterSource source = ParameterSource::kGiven;
  std::string how = {};                    // the plane, axis or map in words; empty for given (u,v)
  MapFaults faults = {};                   // of the map; none for given (u,v)
  Vec2 lengths_mm = Vec2::Constant(kNaN);  // of the domain on a plane or a mesh that is laid out
  // u and v are linear in x and y: the points are heights z over x and y, whose unit may differ.
  bool is_graph = false;
};

// Finds (u,v) and checks once, at the end, that they are one-to-one (fold_check.h): at most 2 % of
// the points may fold or collapse, except where folds are accepted. Without a normal the plane
// across z comes first. Its heights are judged by their shape alone, so that their unit has no
// effect. Heights over a plane across a given normal or another axis that spread more than the
// plane count by their shape too.
// Given (u,v) may have errors; they are refused where they have nothing to do with the points, lie
// on a line, or bring several sheets to one place. du x dv faces the same way as the triangles, if
// there are any. Throws InputError for no points, a corner of a triangle that is no point, `given`
// without (u,v), a number of (u,v) that differs from the number of points, an empty range or (u,v)
// outside of it, points that span no plane or have no extent along the axis, points that fold,
// points that close at an end of their cylinder, `mesh` without triangles, and a mesh that LayOut
// refuses.
Parametrisation Parametrise(Scan scan, const Parameters& parameters = AutoParameters{});
Parametrisation Parametrise(std::span<const Vec3> positions,
                            const Parameters& parameters = AutoParameters{},
                            std::span<const Vec2> given_uv = {});

}  // namespace semblance::fitting
