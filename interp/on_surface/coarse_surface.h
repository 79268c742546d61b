// SPDX-License-Identifier: GPL-3.0-or-later
// A skull's surface with only as many vertices as a smooth field needs.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "surfaces/base/run_context.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::interp {

// The triangles around each vertex of a mesh.
class VertexTriangles {
 public:
  VertexTriangles() = default;
  explicit VertexTriangles(const TriMesh& mesh);

  std::span<const int> At(int vertex) const {
    return {triangles_.data() + first_[vertex],
            static_cast<std::size_t>(first_[vertex + 1] - first_[vertex])};
  }

 private:
  std::vector<int> first_, triangles_;
};

// A point of a mesh as a weighted mean of three vertices (fewer if weights are 0).
struct CornerWeights {
  std::array<int, 3> corners = {0, 0, 0};
  Vec3 weights = Vec3(1, 0, 0);  // >= 0, sum 1
};

// The corner of the point's triangle that is nearest to the point; on a tie, the lowest index.
int NearestCorner(const TriMesh& mesh, const MeshPoint& on);

// A coarse mesh. Its vertices are vertices of the skull, no two of them closer than the edge length
// along the skull's edges. Each of the skull's vertices belongs to the cell of the nearest coarse
// vertex. The mesh has a triangle wherever three cells meet, so that it is the dual of the cells
// and a Delaunay triangulation along the surface. The two sides of a thin wall stay separate,
// slivers vanish, and a skull whose edges are all longer does not change. A strip narrower than the
// edge length may fall apart.
class CoarseSurface {
 public:
  // edge_mm >= 0; 0 keeps the skull. Throws Cancelled if stopped.
  CoarseSurface(const TriMesh& skull, double edge_mm, const RunContext& run);

  const TriMesh& mesh() const { return mesh_; }

  // The point of the coarse mesh closest to p, among the triangles around the cell of a skull's
  // vertex that is near p.
  CornerWeights Locate(const Vec3& p, int skull_vertex) const;

 private:
  TriMesh mesh_;
  std::vector<int> cell_;         // per vertex of the skull
  VertexTriangles triangles_at_;  // of mesh_
};

}  // namespace semblance::interp
