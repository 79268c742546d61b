// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle mesh as two arrays, and what can be computed from it without a search tree. TriMesh is
// the value that stages pass on. It can hold everything that real scans contain: open borders,
// several components, non-manifold edges.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::surfaces {

using Triangle =
    std::array<std::int32_t, 3>;  // indices into points, counter-clockwise seen from outside

struct TriMesh {
  std::vector<Vec3> points;  // mm
  std::vector<Triangle> triangles;
};

Box3 Bounds(const TriMesh& mesh);  // empty box for an empty mesh

Vec3 TriangleCentroid(const TriMesh& mesh, const Triangle& t);
Vec3 TriangleAreaVector(const TriMesh& mesh, const Triangle& t);  // normal times area, mm^2
double Area(const TriMesh& mesh);                                 // mm^2

// Unit normals per vertex. Each triangle counts by its area, so that the slivers of marching cubes
// hardly count. Zero at a vertex that has no triangle of positive area.
std::vector<Vec3> VertexNormals(const TriMesh& mesh);

// Per vertex, a third of the area of its triangles, mm^2.
std::vector<double> VertexAreas(const TriMesh& mesh);

// The component of each triangle; triangles that share a vertex are in one component. Components
// are numbered 0, 1, ... in the order of their first triangles.
struct Components {
  std::vector<int> of_triangle;
  int count = 0;
};
Components ConnectedComponents(const TriMesh& mesh);

// Edge statistics of any mesh. An edge is a boundary edge if it has one triangle, non-manifold if
// it has more than two, and inconsistent if its two triangles run along it in the same direction.
struct EdgeReport {
  std::int64_t edges = 0;
  std::int64_t boundary = 0;
  std::int64_t non_manifold = 0;
  std::int64_t inconsistent = 0;
};
EdgeReport CheckEdges(const TriMesh& mesh);

// The edges of any mesh that have one triangle, sorted; the lower vertex comes first.
using MeshEdge = std::array<std::int32_t, 2>;
std::vector<MeshEdge> BorderEdges(const TriMesh& mesh);

// The closed border loops of a manifold as vertices, with the surface on the left. Each loop starts
// at its lowest vertex, and the loops are in the order of these. Throws InputError, with the name
// of the caller, if the mesh is not a consistently oriented manifold.
using VertexLoop = std::vector<std::int32_t>;
std::vector<VertexLoop> BorderLoops(const TriMesh& mesh, const char* caller);

// Per vertex of a manifold, its neighbours counter-clockwise seen from outside. On a border the
// ring runs from the border to the border. Throws as BorderLoops does.
std::vector<VertexLoop> VertexRings(const TriMesh& mesh, const char* caller);

// Removes the points that no triangle uses. The others keep their order. Returns the former indices
// of the remaining points.
std::vector<std::int32_t> DropUnusedPoints(TriMesh& mesh);

// The triangles for which keep[t] is true and the points that they use, in their former order.
// keep: one entry per triangle.
TriMesh Submesh(const TriMesh& mesh, const std::vector<bool>& keep);

// A coarse substitute for any fine mesh, for uses in which topology does not matter (Rossignac &
// Borrel 1993). The vertices in one cell of a grid that face the same way, by the largest part of
// their normal, become one vertex at their mean. So the two sides of a thin wall stay apart.
// Triangles that lose a corner are dropped. No point moves further than sqrt(3) cells. Throws
// InputError if cell_mm is not positive or a point is not finite.
TriMesh ClusterVertices(const TriMesh& mesh, double cell_mm);

TriMesh Transformed(const TriMesh& mesh, const Similarity& to_from);

}  // namespace semblance::surfaces
