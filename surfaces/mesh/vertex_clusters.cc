// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/vertex_clusters.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

using FacedCell = std::array<std::int64_t, 4>;  // of the grid, and the side that is faced

std::int64_t FacedSide(const Vec3& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (normal[axis] < 0 ? 1 : 0);
}

FacedCell FacedCellOf(const Vec3& p, const Vec3& normal, double cell_mm) {
  if (!p.allFinite()) {
    throw InputError("cluster vertices: a point is not finite; repair the mesh first");
  }
  const auto index = [&](double x) { return static_cast<std::int64_t>(std::floor(x / cell_mm)); };
  return {index(p.x()), index(p.y()), index(p.z()), FacedSide(normal)};
}

}  // namespace

TriMesh ClusterVertices(const TriMesh& mesh, double cell_mm) {
  if (!(cell_mm > 0)) {
    throw InputError(fmt::format("cluster vertices: cell_mm is {}; it must be positive", cell_mm));
  }
  const std::vector<Vec3> normals = VertexNormals(mesh);
  std::map<FacedCell, std::int32_t> clusters;  // numbered in the order of their first vertices
  std::vector<std::int32_t> cluster_of(mesh.points.size());
  TriMesh coarse;
  std::vector<double> members;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    const auto [it, is_new] = clusters.try_emplace(FacedCellOf(mesh.points[v], normals[v], cell_mm),
                                                   static_cast<std::int32_t>(clusters.size()));
    if (is_new) {
      coarse.points.emplace_back(Vec3::Zero());
      members.push_back(0);
    }
    cluster_of[v] = it->second;
    coarse.points[it->second] += mesh.points[v];
    members[it->second] += 1;
  }
  for (std::size_t c = 0; c < members.size(); ++c) {
    coarse.points[c] /= members[c];
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    const Triangle t = {cluster_of[a], cluster_of[b], cluster_of[c]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
      coarse.triangles.push_back(t);
    }
  }
  return coarse;
}

}  // namespace semblance
