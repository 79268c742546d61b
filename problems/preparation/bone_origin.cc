// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/preparation/bone_origin.h"

#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

std::vector<BoneOrigin> OriginOfShell(const TriMesh& shell, const TriMesh& skull,
                                      std::span<const BoneOrigin> of_skull, int threads) {
  constexpr double kAtBone_mm = 2;
  const MeshQuery query(skull);
  std::vector<BoneOrigin> origin(shell.triangles.size());
  ParallelFor(origin.size(), threads, 256, [&](std::size_t t) {
    const MeshPoint bone = query.Closest(TriangleCentroid(shell, shell.triangles[t]));
    const BoneOrigin of_bone = of_skull.empty() ? BoneOrigin::kObserved
                                                : of_skull[static_cast<std::size_t>(bone.triangle)];
    origin[t] = bone.distance_mm > kAtBone_mm ? BoneOrigin::kInferred : of_bone;
  });
  return origin;
}

std::vector<BoneOrigin> OriginUnder(const TriMesh& face, const TriMesh& shell,
                                    std::span<const BoneOrigin> of_shell, int threads) {
  const MeshQuery query(shell);
  std::vector<BoneOrigin> origin(face.points.size());
  ParallelFor(origin.size(), threads, 256, [&](std::size_t v) {
    origin[v] = of_shell[static_cast<std::size_t>(query.Closest(face.points[v]).triangle)];
  });
  return origin;
}

std::array<double, 3> AreaByOrigin_cm2(const TriMesh& mesh, std::span<const BoneOrigin> origin) {
  std::array<double, 3> area_cm2{};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area_cm2[static_cast<std::size_t>(origin[t])] +=
        TriangleAreaVector(mesh, mesh.triangles[t]).norm() / 100;
  }
  return area_cm2;
}

}  // namespace semblance
