// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/remesh.h"

#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <fmt/format.h>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

using RemeshKernel = CGAL::Simple_cartesian<double>;
using SurfaceMesh = CGAL::Surface_mesh<RemeshKernel::Point_3>;
namespace processing = CGAL::Polygon_mesh_processing;

SurfaceMesh ToCgal(const TriMesh& mesh) {
  SurfaceMesh halfedges;
  std::vector<SurfaceMesh::Vertex_index> vertices;
  for (const Vec3& p : mesh.points) {
    vertices.push_back(halfedges.add_vertex({p.x(), p.y(), p.z()}));
  }
  for (const Triangle& t : mesh.triangles) {
    if (halfedges.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]) ==
        SurfaceMesh::null_face()) {
      throw InputError(
          fmt::format("remesh: the mesh is not a consistently oriented manifold at triangle "
                      "{} {} {}; repair it first",
                      t[0], t[1], t[2]));
    }
  }
  return halfedges;
}

TriMesh FromCgal(SurfaceMesh& halfedges) {
  halfedges.collect_garbage();
  TriMesh mesh;
  for (const auto v : halfedges.vertices()) {
    const RemeshKernel::Point_3& p = halfedges.point(v);
    mesh.points.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : halfedges.faces()) {
    Triangle triangle;
    int corner = 0;
    for (const auto v : CGAL::vertices_around_face(halfedges.halfedge(f), halfedges)) {
      triangle[corner++] = static_cast<std::int32_t>(v);
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

}  // namespace

TriMesh Remesh(const TriMesh& mesh, double edge_mm) {
  if (!(edge_mm > 0)) {
    throw InputError(
        fmt::format("remesh: an edge of {} mm is not possible; it must be positive", edge_mm));
  }
  SurfaceMesh halfedges = ToCgal(mesh);
  processing::isotropic_remeshing(halfedges.faces(), edge_mm, halfedges,
                                  processing::parameters::number_of_iterations(2));
  return FromCgal(halfedges);
}

}  // namespace semblance
