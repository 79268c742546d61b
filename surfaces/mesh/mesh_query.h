// SPDX-License-Identifier: GPL-3.0-or-later
// Closest points and rays on a triangle mesh, with the search tree kept for many questions.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// A point on a mesh: barycentric in one of its triangles.
struct MeshPoint {
  Vec3 position = Vec3::Constant(kNaN);  // mm
  int triangle = -1;
  double distance_mm = kNaN;  // from the point asked about; for a ray, along the ray
  // Of the triangle's corners: position is their weighted sum; >= 0, sum 1.
  Vec3 weights = Vec3::Constant(kNaN);
};

// Keeps its own copy of what it needs; const calls are safe from several threads at once.
class MeshQuery {
 public:
  // Throws InputError if the mesh has no triangle or a point that is not finite.
  explicit MeshQuery(const TriMesh& mesh);
  ~MeshQuery();
  MeshQuery(MeshQuery&&) noexcept;
  MeshQuery& operator=(MeshQuery&&) noexcept;

  MeshPoint Closest(const Vec3& p) const;

  // The first point along the ray from `origin` in `direction` (not zero, need not be unit), no
  // further than max_distance_mm; none if nothing is hit.
  std::optional<MeshPoint> FirstHit(const Vec3& origin, const Vec3& direction,
                                    double max_distance_mm) const;

  // All points along the ray, nearest first; a hit on a shared edge may be listed once for each of
  // its triangles.
  std::vector<MeshPoint> AllHits(const Vec3& origin, const Vec3& direction,
                                 double max_distance_mm) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace semblance
