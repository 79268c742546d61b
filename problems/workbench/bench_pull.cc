// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/workbench/bench_pull.h"

#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

Vec2 HeldParameter(const HSplineSurface& face, const Vec3& at) {
  constexpr int kPerPatch = 2;
  const Tessellation shown = Tessellate(face, kPerPatch);
  const MeshPoint nearest = MeshQuery(shown.mesh).Closest(at);
  Vec2 uv = Vec2::Zero();
  for (int k = 0; k < 3; ++k) {  // beside the seam of a closed surface the corners' u may jump
    uv += nearest.weights[k] * shown.uv[shown.mesh.triangles[nearest.triangle][k]];
  }
  return uv;
}

std::array<std::vector<Vec3>, 3> PullMoves(const HSplineSurface& face, Pull pull, int per_patch) {
  const std::vector<Vec3> before = Tessellate(face, per_patch).mesh.points;
  std::array<std::vector<Vec3>, 3> moves;
  for (int axis = 0; axis < 3; ++axis) {
    pull.by_mm = Vec3::Unit(axis);
    HSplineSurface pulled = face;
    ApplyEdits(Pulled(pull, face, {}), pulled);
    moves[axis] = Tessellate(pulled, per_patch).mesh.points;
    for (std::size_t v = 0; v < before.size(); ++v) {
      moves[axis][v] -= before[v];
    }
  }
  return moves;
}

}  // namespace semblance
