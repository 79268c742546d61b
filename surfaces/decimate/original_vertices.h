// SPDX-License-Identifier: GPL-3.0-or-later
// The vertices of the original mesh, carried along while it is decimated. Each vertex belongs to
// one remaining triangle, and finally pulls that triangle towards itself.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// Keeps a reference to the original mesh. The remaining triangles keep their original indices.
class OriginalVertices {
 public:
  explicit OriginalVertices(const TriMesh& mesh);

  const Vec3& Position(std::int32_t vertex) const { return mesh_.points[vertex]; }
  // Appends the vertices that belong to the triangle.
  void AppendVertices(std::int32_t triangle, std::vector<std::int32_t>& vertices) const;
  void Clear(std::int32_t triangle) { first_[triangle] = -1; }
  void Assign(std::int32_t triangle, std::int32_t vertex, double distance_mm);

  // The largest distance assigned to any vertex.
  double LargestDistance_mm() const;

  // An upper bound on the distance of p from the original mesh: its distance from the original
  // triangles at the nearest of the given vertices. Infinite if no vertices are given.
  double DistanceBound_mm(const Vec3& p, const std::vector<std::int32_t>& vertices) const;

  // Moves the points of the remaining mesh towards the least sum of squared distances of the
  // original vertices from the planes of their triangles: two half steps of Gauss-Newton, none
  // longer than the largest distance that pulls the point. A point whose step would turn a triangle
  // by more than 60 degrees stays, and so does a fixed point. Recomputes the distances afterwards.
  //   triangles: the indices of the remaining triangles
  //   left: these triangles, in this order, and all points
  void Settle(const std::vector<std::int32_t>& triangles,
              const std::function<bool(std::int32_t)>& is_fixed, TriMesh& left);

 private:
  void UpdateDistances(const std::vector<std::int32_t>& triangles, const TriMesh& left);

  const TriMesh& mesh_;
  std::vector<std::int32_t> first_, next_;  // a linked list per triangle; -1 ends it
  std::vector<double> distance_mm_;         // per vertex
  std::vector<std::int32_t> corner_of_;     // the triangles at vertex v end at last_[v]
  std::vector<std::int32_t> last_;
};

}  // namespace semblance::surfaces
