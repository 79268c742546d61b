// SPDX-License-Identifier: GPL-3.0-or-later
// The layout of a mesh on the plane, which gives its points (u,v).
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::fitting {

enum class MeshMap { kAuto, kArap, kLscm, kMeanValue, kTutte };
constexpr auto EnumNames(MeshMap) {
  return std::to_array<std::string_view>({"auto", "arap", "lscm", "mean_value", "tutte"});
}

struct MeshLayout {
  std::vector<Vec2> at;          // per point, mm; of the same area as the mesh, counter-clockwise
  MeshMap map = MeshMap::kAuto;  // the map that was used
};

// Lays the mesh out by CGAL's Surface_mesh_parameterization.
// - With a free border, turned so that the longest side lies along the first axis: as rigid as
//   possible (ARAP; Liu et al. 2008), or least-squares conformal (LSCM; Levy et al. 2002).
// - With the border on a square, whose corners are the corners of the border as seen along its
// least
//   spread: mean-value coordinates (Floater 2003), or uniform weights (Tutte 1963). Neither folds.
// - kAuto takes ARAP, or mean_value if ARAP folds.
//   mesh: one piece with a border, manifold, without handles, every point used. The longest border
//     counts; the other borders are bridged during the layout.
// Throws InputError for any other mesh, with its fault and the remedy, and if the layout fails.
MeshLayout LayOut(const TriMesh& mesh, MeshMap map);

}  // namespace semblance::fitting
