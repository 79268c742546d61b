// SPDX-License-Identifier: GPL-3.0-or-later
// Closest points, rays and visibility on a triangle mesh, and distances from a set of points. The
// query classes keep a search tree for many questions.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

struct TrianglePoint {
  Vec3 position = Vec3::Constant(kNaN);  // on the triangle, mm
  Vec3 weights = Vec3::Constant(kNaN);   // of the corners a, b, c; >= 0, sum 1
};

// The closest point of one triangle, without a search tree. A triangle without area is the union of
// its edges. All points must be finite.
TrianglePoint ClosestPointOnTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

// A point on a mesh, with barycentric weights in one of its triangles.
struct MeshPoint {
  Vec3 position = Vec3::Constant(kNaN);  // mm
  int triangle = -1;
  double distance_mm = kNaN;            // from the query point; for a ray, along the ray
  Vec3 weights = Vec3::Constant(kNaN);  // of the triangle's corners; >= 0, sum 1
};

// Keeps its own copy of what it needs. Const calls are safe from several threads at once.
class MeshQuery {
 public:
  // Throws InputError if the mesh has no triangle or a point that is not finite.
  explicit MeshQuery(const TriMesh& mesh);
  ~MeshQuery();
  MeshQuery(MeshQuery&&) noexcept;
  MeshQuery& operator=(MeshQuery&&) noexcept;

  MeshPoint Closest(const Vec3& p) const;

  // The triangles within distance_mm of p, in ascending order, and possibly others just outside: a
  // superset that spares a pass over the whole mesh.
  std::vector<int> TrianglesNear(const Vec3& p, double distance_mm) const;

  // The first point along the ray from `origin` in `direction` (not zero; it need not be unit)
  // within max_distance_mm, or nothing.
  std::optional<MeshPoint> FirstHit(const Vec3& origin, const Vec3& direction,
                                    double max_distance_mm) const;

  // All points along the ray within max_distance_mm, nearest first. A hit on a shared edge may be
  // listed once for each of its triangles.
  std::vector<MeshPoint> AllHits(const Vec3& origin, const Vec3& direction,
                                 double max_distance_mm) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

// Finds the side of a mesh that faces the open, without the walls of cavities. The result has one
// entry per triangle: true if a straight line from its centre leaves the mesh without meeting
// another triangle, along the normal or along one of eight directions 60 degrees from it. So skin
// counts as seen, also in folds that are as wide as deep. Walls of sinuses, airways and of an inner
// layer do not, whether the mesh is closed or not. Triangles must be counter-clockwise seen from
// outside. threads >= 1; the result does not depend on it. Throws InputError as MeshQuery does.
std::vector<bool> SeenFromOutside(const TriMesh& mesh, int threads);

// Keeps its own copy of the points. Const calls are safe from several threads at once.
class PointQuery {
 public:
  // Throws InputError if there is no point, or one that is not finite.
  explicit PointQuery(std::span<const Vec3> points);
  ~PointQuery();
  PointQuery(PointQuery&&) noexcept;
  PointQuery& operator=(PointQuery&&) noexcept;

  // The distance in mm from p to its `rank`-th nearest point (rank >= 1). Rank 1 is the nearest
  // point, which is p itself if p is one of them. Infinite if there are fewer points than `rank`.
  double DistanceTo(const Vec3& p, int rank = 1) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace semblance::surfaces
