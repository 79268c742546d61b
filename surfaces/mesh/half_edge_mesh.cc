// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/half_edge_mesh.h"

#include <fmt/format.h>

#include <array>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

// OpenMesh reports each face that it refuses to std::cerr, but a library must not print. The
// streams belong to the whole process, so they are switched off once: switching them on again after
// each mesh would be a race between threads.
void SilenceOpenMesh() {
  [[maybe_unused]] static const bool kSilent = [] {
    omerr().disable();
    return true;
  }();
}

bool RepeatsCorner(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

bool AddFace(const Triangle& t, HalfEdgeMesh& mesh) {
  const auto vertex = [](std::int32_t v) { return OpenMesh::VertexHandle(v); };
  return !RepeatsCorner(t) && mesh.add_face(vertex(t[0]), vertex(t[1]), vertex(t[2])).is_valid();
}

// A face of its own for triangle t, on copies of its corners.
void AddApart(const TriMesh& mesh, std::int32_t t, HalfEdges& half_edges) {
  Triangle copies;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::int32_t v = mesh.triangles[t][c];
    copies[c] = half_edges.mesh.add_vertex(mesh.points[v]).idx();
    half_edges.copy_of.push_back(v);
  }
  AddFace(copies, half_edges.mesh);
  half_edges.refused.push_back(t);
}

[[noreturn]] void ThrowNoManifold(const Triangle& t, const char* caller) {
  throw InputError(
      fmt::format("{}: the mesh is not a consistently oriented manifold at triangle {} {} {}; "
                  "repair it first",
                  caller, t[0], t[1], t[2]));
}

}  // namespace

HalfEdges MakeHalfEdges(const TriMesh& mesh) {
  SilenceOpenMesh();
  HalfEdges half_edges;
  const std::size_t triangles = mesh.triangles.size();
  half_edges.mesh.reserve(mesh.points.size(), 3 * triangles / 2, triangles);
  for (const Vec3& p : mesh.points) {
    half_edges.mesh.add_vertex(p);
  }
  for (std::int32_t t = 0; t < std::ssize(mesh.triangles); ++t) {
    if (!AddFace(mesh.triangles[t], half_edges.mesh)) {
      AddApart(mesh, t, half_edges);
    }
  }
  return half_edges;
}

bool IsPinched(const HalfEdgeMesh& mesh, OpenMesh::VertexHandle vertex) {
  return mesh.is_boundary(vertex) && !mesh.is_manifold(vertex);
}

HalfEdgeMesh MakeManifold(const TriMesh& mesh, const char* caller) {
  HalfEdges half_edges = MakeHalfEdges(mesh);
  if (!half_edges.refused.empty()) {
    ThrowNoManifold(mesh.triangles[half_edges.refused.front()], caller);
  }
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) {
      if (IsPinched(half_edges.mesh, OpenMesh::VertexHandle(v))) {
        ThrowNoManifold(t, caller);
      }
    }
  }
  return std::move(half_edges.mesh);
}

}  // namespace semblance::surfaces
