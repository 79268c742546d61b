// SPDX-License-Identifier: GPL-3.0-or-later
// Seeds: extra points for the fit, taken from the implicit face. Thesis 4.2 requires one point per
// patch of the finest fitted level, and 5.3 proposes points of the implicit surface with the
// features masked.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::fitting {

// kRay takes the nearest point along a direction, forwards or backwards, whose triangle faces along
// it. kClosest takes the nearest point of the mesh. Rays spread the seeds evenly even over
// distances of 10 to 20 mm. Nearest points crowd on ridges and leave hollows empty, so they suit a
// surface that is already close.
enum class SeedMethod { kRay, kClosest };
constexpr auto EnumNames(SeedMethod) { return std::to_array<std::string_view>({"ray", "closest"}); }

struct SeedOptions {
  static constexpr std::string_view kName = "patches";
  SeedMethod method = SeedMethod::kRay;
  int level = 2;
  int direction_level = 0;
  double max_distance_mm = 30;
  double max_normal_angle_deg = 60;
  double weight = 1;
};
template <class Visitor>
void Fields(Visitor& visit, SeedOptions& o) {
  visit(FieldInfo{.name = "method", .doc = "ray: along a smoothed normal; closest: nearest point"},
        o.method);
  visit(FieldInfo{.name = "level",
                  .min = 0,
                  .max = 8,
                  .doc = "one seed at the centre of each patch of this level; use the finest "
                         "fitted level (thesis 4.2)"},
        o.level);
  visit(FieldInfo{.name = "direction_level",
                  .min = 0,
                  .max = 8,
                  .doc = "a seed's direction is the normal of this level's surface, without finer "
                         "detail; a coarser level gives smoother directions"},
        o.direction_level);
  visit(FieldInfo{.name = "max_distance_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 500,
                  .doc = "largest distance of a seed from the surface"},
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
                  .doc = "weight of a seed in the fit; a standard dowel has 1"},
        o.weight);
}

// No seeds: the fit has the dowels alone (thesis figure 4.3).
struct NoSeeds {
  static constexpr std::string_view kName = "none";
};
template <class Visitor>
void Fields(Visitor&, NoSeeds&) {}

using SeedSource = std::variant<SeedOptions, NoSeeds>;

struct SeedResult {
  std::vector<FitPoint> points;  // seeds, labelled seed_i_j after their patch (i, j), i fastest
  int masked = -1;               // patches whose centre or seed lies in a mask
  int missed = -1;               // patches without a suitable point of the mesh
  int folded = -1;               // seeds dropped because they changed places with neighbours
};

// Finds a point of the implicit face for each patch of `placed`, which lies near it.
//   placed: normals (du x dv) point out of the face.
//   implicit, implicit_mesh: the same mesh, triangles counter-clockwise seen from outside.
//   masks: spheres without seeds (nose, mouth, orbits), mm, in the common frame.
// A seed fixes the (u,v) of its place, and hundreds of seeds outweigh the dowels. On a template
// that was only placed they preserve every tangential error of the placement. Therefore fit the
// dowels alone first (level 0 at fraction 1 is enough), seed on the result, and fit both with the
// placed template as `rest`. The same works between the steps of a schedule. Throws InputError for
// options out of range, a direction level that the surface does not have, or a mask that is not a
// sphere.
SeedResult SeedDowels(const HSplineSurface& placed, const MeshQuery& implicit,
                      const TriMesh& implicit_mesh, std::span<const Sphere> masks,
                      const SeedOptions& options);

}  // namespace semblance::fitting
