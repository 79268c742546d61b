// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/correspondences.h"

#include <algorithm>
#include <utility>

namespace semblance::surfaces {
namespace {

std::vector<char> BorderVertices(const TriMesh& mesh, OpenBorder border) {
  if (border == OpenBorder::kAccept) {
    return {};
  }
  std::vector<char> on_border(mesh.points.size(), 0);
  for (const MeshEdge& edge : BorderEdges(mesh)) {
    on_border[edge[0]] = on_border[edge[1]] = 1;
  }
  return on_border;
}

}  // namespace

Correspondences::Correspondences(const TriMesh& mesh, OpenBorder border)
    : Correspondences(mesh, VertexNormals(mesh), border) {}

Correspondences::Correspondences(const TriMesh& mesh, std::vector<Vec3> vertex_normals,
                                 OpenBorder border)
    : triangles_(mesh.triangles),
      normals_(std::move(vertex_normals)),
      on_border_(BorderVertices(mesh, border)),
      query_(mesh) {}

std::optional<Correspondence> Correspondences::Find(const Vec3& p, const Vec3& normal,
                                                    const CorrespondenceOptions& options) const {
  return Check(query_.Closest(p), normal, options);
}

std::optional<Correspondence> Correspondences::Check(const MeshPoint& point, const Vec3& normal,
                                                     const CorrespondenceOptions& options) const {
  const bool beside_border =
      !on_border_.empty() && std::ranges::any_of(triangles_[point.triangle], [&](std::int32_t v) {
        return on_border_[v] != 0;
      });
  if (!(point.distance_mm <= options.reach_mm) || beside_border) {
    return std::nullopt;
  }
  const Vec3 own = NormalAt(point);
  const bool faces_alike = options.least_cosine <= -1 || own.dot(normal) >= options.least_cosine;
  return faces_alike ? std::optional(Correspondence{point, own}) : std::nullopt;
}

Vec3 Correspondences::NormalAt(const MeshPoint& point) const {
  const Triangle& t = triangles_[point.triangle];
  return (point.weights[0] * normals_[t[0]] + point.weights[1] * normals_[t[1]] +
          point.weights[2] * normals_[t[2]])
      .normalized();
}

}  // namespace semblance::surfaces
