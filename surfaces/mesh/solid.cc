// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/solid.h"

#include <algorithm>
#include <array>

namespace semblance::surfaces {

std::vector<double> EnclosedVolumes(const TriMesh& mesh, const Components& components) {
  std::vector<double> volumes(components.count, 0);
  const Vec3 middle = Bounds(mesh).center();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& c = mesh.triangles[t];
    const Vec3 a = mesh.points[c[0]] - middle, b = mesh.points[c[1]] - middle;
    volumes[components.of_triangle[t]] += a.dot(b.cross(mesh.points[c[2]] - middle)) / 6;
  }
  return volumes;
}

bool BoundsSolid(const TriMesh& mesh) {
  const EdgeReport edges = CheckEdges(mesh);
  if (mesh.triangles.empty() || edges.boundary + edges.non_manifold + edges.inconsistent > 0) {
    return false;
  }
  return std::ranges::all_of(EnclosedVolumes(mesh, ConnectedComponents(mesh)),
                             [](double volume) { return volume > 0; });
}

Solid::Solid(const TriMesh& mesh) : box_(Bounds(mesh)), query_(mesh) {
  for (const Triangle& t : mesh.triangles) {
    area_vectors_.push_back(TriangleAreaVector(mesh, t));
  }
}

// Returns true if the ray from p leaves the mesh more often than it enters.
bool Solid::IsLeft(const Vec3& p, const Vec3& direction) const {
  int leaves = 0;
  for (const MeshPoint& hit : query_.AllHits(p, direction, 2 * box_.diagonal().norm())) {
    leaves += area_vectors_[hit.triangle].dot(direction) > 0 ? 1 : -1;
  }
  return leaves > 0;
}

bool Solid::Contains(const Vec3& p) const {
  // Any three that are along no axis and in no plane of symmetry.
  static const std::array<Vec3, 3> kDirections = {Vec3(0.36, 0.48, 0.8), Vec3(-0.71, 0.64, -0.29),
                                                  Vec3(0.53, -0.83, 0.17)};
  if (!box_.contains(p)) {
    return false;
  }
  const bool first = IsLeft(p, kDirections[0]), second = IsLeft(p, kDirections[1]);
  return first == second ? first : IsLeft(p, kDirections[2]);
}

}  // namespace semblance::surfaces
