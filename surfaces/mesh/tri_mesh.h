// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle mesh as two arrays, and what can be computed from it without a search tree. It can
// hold what real scans hold (open borders, several components, non-manifold edges); half-edge
// structures are built from it where an algorithm needs them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

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

// Unit normals per vertex, weighted by the area of its triangles, so that the slivers of marching
// cubes hardly count. Zero where a vertex has no triangle of positive area.
std::vector<Vec3> VertexNormals(const TriMesh& mesh);

// A third of the area of the triangles at each vertex, mm^2.
std::vector<double> VertexAreas(const TriMesh& mesh);

// Component of each triangle by shared vertices, numbered 0, 1, ... in order of the first triangle.
struct Components {
  std::vector<int> of_triangle;
  int count = 0;
};
Components ConnectedComponents(const TriMesh& mesh);

// Edge statistics. An edge is boundary with one triangle, non-manifold with more than two,
// inconsistent if its two triangles run along it in the same direction.
struct EdgeReport {
  std::int64_t edges = 0;
  std::int64_t boundary = 0;
  std::int64_t non_manifold = 0;
  std::int64_t inconsistent = 0;
};
EdgeReport CheckEdges(const TriMesh& mesh);

// The edges with one triangle, lower vertex first, sorted.
using MeshEdge = std::array<std::int32_t, 2>;
std::vector<MeshEdge> BorderEdges(const TriMesh& mesh);

// Leaves out the points that no triangle uses; the others stay in their order. Returns the indices
// that these had.
std::vector<std::int32_t> DropUnusedPoints(TriMesh& mesh);

// The triangles for which keep[t] is true, and the points they use, in their old order. keep: one
// entry per triangle.
TriMesh Submesh(const TriMesh& mesh, const std::vector<bool>& keep);

TriMesh Transformed(const TriMesh& mesh, const Similarity& to_from);

}  // namespace semblance
