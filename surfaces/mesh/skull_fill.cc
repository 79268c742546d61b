// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/skull_fill.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#include <fmt/format.h>

#include <algorithm>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::surfaces {
namespace {

using RemeshKernel = CGAL::Simple_cartesian<double>;
using RemeshMesh = CGAL::Surface_mesh<RemeshKernel::Point_3>;
using WrapKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using WrapMesh = CGAL::Surface_mesh<WrapKernel::Point_3>;

RemeshMesh ToCgal(const TriMesh& mesh) {
  RemeshMesh half_edges;
  std::vector<RemeshMesh::Vertex_index> vertices;
  for (const Vec3& p : mesh.points) {
    vertices.push_back(half_edges.add_vertex({p.x(), p.y(), p.z()}));
  }
  for (const Triangle& t : mesh.triangles) {
    if (half_edges.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]) ==
        RemeshMesh::null_face()) {
      throw InputError(
          fmt::format("remesh: the mesh is not a consistently oriented manifold at triangle "
                      "{} {} {}; repair it first",
                      t[0], t[1], t[2]));
    }
  }
  return half_edges;
}

// half_edges: without garbage.
template <class Mesh>
TriMesh FromCgal(const Mesh& half_edges) {
  TriMesh mesh;
  for (const auto v : half_edges.vertices()) {
    const auto& p = half_edges.point(v);
    mesh.points.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : half_edges.faces()) {
    Triangle triangle;
    int corner = 0;
    for (const auto v : CGAL::vertices_around_face(half_edges.halfedge(f), half_edges)) {
      triangle[corner++] = static_cast<std::int32_t>(v);
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

// The distance of the wrap from bone. It is small against the pull, which lays the wrap onto bone
// again.
constexpr double kWrapOffset_mm = 0.6;

TriMesh Wrap(const TriMesh& skull, double alpha_mm) {
  std::vector<WrapKernel::Point_3> points;
  std::vector<std::vector<std::size_t>> faces;
  for (const Vec3& p : skull.points) {
    points.emplace_back(p.x(), p.y(), p.z());
  }
  for (const Triangle& t : skull.triangles) {
    faces.push_back({static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]),
                     static_cast<std::size_t>(t[2])});
  }
  WrapMesh wrap;
  CGAL::alpha_wrap_3(points, faces, alpha_mm, kWrapOffset_mm, wrap);
  return FromCgal(wrap);
}

// Moves points near bone onto it: all the way up to a distance of pull_mm, fading out at twice
// that.
TriMesh PullOntoBone(TriMesh shell, const MeshQuery& bone, double pull_mm,
                     const RunContext& context) {
  if (pull_mm == 0) {
    return shell;
  }
  ParallelFor(shell.points.size(), context.threads, 256, [&](std::size_t v) {
    const MeshPoint nearest = bone.Closest(shell.points[v]);
    const double share = std::clamp(2 - nearest.distance_mm / pull_mm, 0.0, 1.0);
    shell.points[v] += share * (nearest.position - shell.points[v]);
  });
  return shell;
}

TriMesh Fill(const TriMesh& skull, const NoFill&, const RunContext&) { return skull; }

TriMesh Fill(const TriMesh& skull, const WrapFill& fill, const RunContext& context) {
  context.Report("fill skull", "wrapping");
  const TriMesh wrap = Wrap(skull, fill.alpha_mm);
  context.ThrowIfStopped();
  context.Report("fill skull", "laying the shell onto bone");
  return PullOntoBone(Remesh(wrap, fill.edge_mm), MeshQuery(skull), fill.pull_mm, context);
}

}  // namespace

TriMesh FillSkull(const TriMesh& skull, const SkullFill& fill, const RunContext& context) {
  return std::visit([&](const auto& options) { return Fill(skull, options, context); }, fill);
}

TriMesh Remesh(const TriMesh& mesh, double edge_mm) {
  if (!(edge_mm > 0)) {
    throw InputError(
        fmt::format("remesh: an edge of {} mm is not possible; it must be positive", edge_mm));
  }
  RemeshMesh half_edges = ToCgal(mesh);
  CGAL::Polygon_mesh_processing::isotropic_remeshing(
      half_edges.faces(), edge_mm, half_edges,
      CGAL::Polygon_mesh_processing::parameters::number_of_iterations(2));
  half_edges.collect_garbage();
  return FromCgal(half_edges);
}

}  // namespace semblance::surfaces
