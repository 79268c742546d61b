// SPDX-License-Identifier: GPL-3.0-or-later
// Half-edges by OpenMesh, for work that walks along borders and around vertices or changes the
// connectivity. This header is private to the .cc files of `surfaces`; TriMesh is the value that
// others get.
#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
// EigenVectorT.hh specialises a template that the mesh header declares, so it must come second.
#include <OpenMesh/Core/Geometry/EigenVectorT.hh>

#include <cstdint>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

struct HalfEdgeTraits : OpenMesh::DefaultTraits {
  using Point = Vec3;
  using Normal = Vec3;
};
using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<HalfEdgeTraits>;

// The half-edges of any TriMesh. Vertex v is point v and face t is triangle t, so arrays with one
// entry per point or triangle fit both.
struct HalfEdges {
  HalfEdgeMesh mesh;
  // The triangles that OpenMesh refuses because they would not leave an oriented manifold: a third
  // one at an edge, one turned against its neighbour, one that closes a fan at a vertex with
  // another fan, one that repeats a corner. Their faces stand alone, on copies of their corners.
  std::vector<std::int32_t> refused;
  // Copy k is vertex `points.size() + k`, at the place of vertex copy_of[k].
  std::vector<std::int32_t> copy_of;
};

// Loses no triangle. If the copies and their originals stay where they are, replacing each copy by
// its original afterwards joins again what was cut.
HalfEdges MakeHalfEdges(const TriMesh& mesh);

// True if the faces at the vertex form several fans, which OpenMesh accepts.
bool IsPinched(const HalfEdgeMesh& mesh, OpenMesh::VertexHandle vertex);

// The half-edges of a consistently oriented manifold, without copies. Throws InputError for any
// other mesh, with the name of the caller and a triangle at fault.
HalfEdgeMesh MakeManifold(const TriMesh& mesh, const char* caller);

}  // namespace semblance::surfaces
