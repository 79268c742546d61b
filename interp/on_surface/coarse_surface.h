// SPDX-License-Identifier: GPL-3.0-or-later
// A skull's surface with fewer vertices: as many as a smooth field needs.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "surfaces/base/run_context.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// A point of a mesh by its values at three vertices; fewer where weights are 0.
struct CornerWeights {
  std::array<int, 3> corners = {0, 0, 0};
  Vec3 weights = Vec3(1, 0, 0);  // >= 0, sum 1
};

// The corner of the point's triangle that is nearest to it; the first of equal ones.
int NearestCorner(const TriMesh& mesh, const MeshPoint& on);

// The vertices of `mesh` are vertices of the skull, no two of them within the edge length along the
// skull's edges. Each of the skull's vertices belongs to the cell of the nearest of them; where
// three cells meet, `mesh` has a triangle (the dual of the cells, a Delaunay triangulation along
// the surface). So two sides of a thin wall stay apart, slivers are gone, and a skull whose edges
// are all longer comes out as it was. A strip narrower than the edge length may come apart.
class CoarseSurface {
 public:
  // edge_mm >= 0; 0: the skull itself. Throws Cancelled if stopped.
  CoarseSurface(const TriMesh& skull, double edge_mm, const RunContext& run);

  const TriMesh& mesh() const { return mesh_; }

  // Where the mesh is closest to p, among the triangles around the cell of one of the skull's
  // vertices that is near p.
  CornerWeights Locate(const Vec3& p, int skull_vertex) const;

 private:
  std::span<const int> TrianglesAt(int vertex) const {
    return {triangles_at_.data() + first_at_[vertex],
            static_cast<std::size_t>(first_at_[vertex + 1] - first_at_[vertex])};
  }

  TriMesh mesh_;
  std::vector<int> cell_;                     // of each of the skull's vertices
  std::vector<int> first_at_, triangles_at_;  // the triangles of each vertex of mesh_
};

}  // namespace semblance
