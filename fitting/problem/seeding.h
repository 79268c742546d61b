// SPDX-License-Identifier: GPL-3.0-or-later
// Extra dowels for the fit, taken from the implicit face: thesis 4.2 asks for one point per patch
// of the finest fitted level, and 5.3 for points of the implicit surface with the features masked.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// kRay looks along a direction, both ways, for the nearest point whose triangle faces along it.
// kClosest takes the nearest point of the mesh. Rays spread the seeds evenly even at 10 to 20 mm;
// nearest points crowd on ridges and leave hollows empty, and suit a surface that is already close.
enum class SeedMethod { kRay, kClosest };
constexpr auto EnumNames(SeedMethod) { return std::to_array<std::string_view>({"ray", "closest"}); }

struct SeedOptions {
  SeedMethod method = SeedMethod::kRay;  // how its point on the implicit face is found
  int level = 2;                         // a seed at the centre of each of its patches
  int direction_level = 0;               // whose normal is its direction; coarser is smoother
  double max_distance_mm = 30;           // from the surface
  double max_normal_angle_deg = 60;      // between its direction and its triangle's normal
  double weight = 1;                     // in the fit; a standard dowel has 1
};
template <class Visitor>
void Fields(Visitor& visit, SeedOptions& o) {
  visit(FieldInfo{.name = "method", .doc = "ray: along a smoothed normal; closest: nearest point"},
        o.method);
  visit(FieldInfo{.name = "level",
                  .min = 0,
                  .max = 8,
                  .doc = "one seed at the centre of each patch of this level; the finest fitted "
                         "level is best (thesis 4.2)"},
        o.level);
  visit(FieldInfo{.name = "direction_level",
                  .min = 0,
                  .max = 8,
                  .doc = "the normal of this level's surface, without finer detail, is the "
                         "direction of a seed; coarser is smoother"},
        o.direction_level);
  visit(FieldInfo{.name = "max_distance_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 500,
                  .doc = "how far from the surface a seed may lie"},
        o.max_distance_mm);
  visit(FieldInfo{.name = "max_normal_angle_deg",
                  .unit = "deg",
                  .min = 0,
                  .max = 90,
                  .doc = "largest angle between a seed's direction and its triangle's normal"},
        o.max_normal_angle_deg);
  visit(FieldInfo{.name = "weight",
                  .min = 1e-6,
                  .max = 1e6,
                  .doc = "of a seed in the fit; a standard dowel has 1"},
        o.weight);
}

struct SeedResult {
  std::vector<FitPoint> points;  // seeds, labelled seed_i_j by their patch (i, j), i fastest
  int masked = -1;               // patches whose centre, or whose seed, lies in a mask
  int missed = -1;               // patches for which the mesh has no fitting point
  int folded = -1;               // seeds dropped because neighbours had changed places
};

// Seeds points of the implicit face for the patches of `placed`, which lies near it.
//   placed: normals (du x dv) point out of the face.
//   implicit, implicit_mesh: the same mesh, triangles counter-clockwise seen from outside.
//   masks: where no seed is wanted (nose, mouth, orbits), mm, in the common frame.
// A seed fixes which (u,v) belongs to its place, and hundreds of them outvote the dowels. On a
// template that was only placed they pin every tangential error of the placement; so fit the dowels
// alone first (level 0 at fraction 1 is enough), seed on the result, and fit both with the placed
// template as `rest`. It can be called again between the steps of a schedule in the same way.
// Throws InputError for options out of range, a direction level that the surface does not have, or
// a mask that is not a sphere.
SeedResult SeedDowels(const HSplineSurface& placed, const MeshQuery& implicit,
                      const TriMesh& implicit_mesh, std::span<const Sphere> masks,
                      const SeedOptions& options);

}  // namespace semblance
