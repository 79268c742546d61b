// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles laid out on the plane, so that their corners have (u,v).
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

enum class MeshMap { kAuto, kArap, kLscm, kMeanValue, kTutte };
constexpr auto EnumNames(MeshMap) {
  return std::to_array<std::string_view>({"auto", "arap", "lscm", "mean_value", "tutte"});
}

struct MeshLayout {
  std::vector<Vec2> at;  // per point; as large in all as the mesh, mm^2, and the right way round
  MeshMap map = MeshMap::kAuto;  // that was taken
};

// With a free border: as rigid as possible (ARAP; Liu et al. 2008), or least-squares conformal
// (LSCM; Levy et al. 2002), turned so that the longest side lies along the first axis. With the
// border on a square, whose corners are those of the border seen along its least spread:
// mean-value coordinates (Floater 2003), or uniform weights (Tutte 1963), neither of which folds.
// kAuto: ARAP, or mean_value where that folds. By CGAL's Surface_mesh_parameterization.
//   mesh: one piece with a border, manifold, without handles, every point used. Of several borders
//     the longest is the border, and the others are bridged while the mesh is laid out.
// Throws InputError for any other mesh, with what it has instead and what to do, and where no
// layout is found.
MeshLayout LayOut(const TriMesh& mesh, MeshMap map);

}  // namespace semblance
