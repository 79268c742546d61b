// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate.h"

#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <fmt/format.h>

#include "surfaces/error.h"

namespace semblance {
namespace {

using QuadricKernel = CGAL::Simple_cartesian<double>;
using SurfaceMesh = CGAL::Surface_mesh<QuadricKernel::Point_3>;
namespace simplification = CGAL::Surface_mesh_simplification;
namespace processing = CGAL::Polygon_mesh_processing;

SurfaceMesh ToCgal(const TriMesh& mesh, const char* who) {
  SurfaceMesh halfedges;
  std::vector<SurfaceMesh::Vertex_index> vertices;
  for (const Vec3& p : mesh.points) {
    vertices.push_back(halfedges.add_vertex({p.x(), p.y(), p.z()}));
  }
  for (const Triangle& t : mesh.triangles) {
    if (halfedges.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]) ==
        SurfaceMesh::null_face()) {
      throw InputError(
          fmt::format("{}: the mesh is not a consistently oriented manifold at triangle {} {} {}; "
                      "repair it first",
                      who, t[0], t[1], t[2]));
    }
  }
  return halfedges;
}

TriMesh FromCgal(SurfaceMesh& halfedges) {
  halfedges.collect_garbage();
  TriMesh mesh;
  for (const auto v : halfedges.vertices()) {
    const QuadricKernel::Point_3& p = halfedges.point(v);
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

// Stops at a number of faces: an inner collapse takes two.
class FaceCountStop {
 public:
  FaceCountStop(const SurfaceMesh& mesh, int target) : mesh_(mesh), target_(target) {}
  template <class Cost, class Profile>
  bool operator()(const Cost&, const Profile&, std::size_t, std::size_t) const {
    return static_cast<int>(mesh_.number_of_faces()) <= target_;
  }

 private:
  const SurfaceMesh& mesh_;
  int target_;
};

}  // namespace

TriMesh Decimate(const TriMesh& mesh, int target_triangles) {
  if (target_triangles < 4) {
    throw InputError(
        fmt::format("decimate: {} triangles are too few; at least 4 are needed", target_triangles));
  }
  if (static_cast<int>(mesh.triangles.size()) <= target_triangles) {
    return mesh;
  }
  SurfaceMesh halfedges = ToCgal(mesh, "decimate");
  using Policies = simplification::GarlandHeckbert_plane_policies<SurfaceMesh, QuadricKernel>;
  const Policies policies(halfedges);
  simplification::edge_collapse(halfedges, FaceCountStop(halfedges, target_triangles),
                                CGAL::parameters::get_cost(policies.get_cost())
                                    .get_placement(policies.get_placement())
                                    .filter(simplification::Bounded_normal_change_filter<>()));
  return FromCgal(halfedges);
}

TriMesh Remesh(const TriMesh& mesh, double edge_mm) {
  if (!(edge_mm > 0)) {
    throw InputError(
        fmt::format("remesh: an edge of {} mm is not possible; it must be positive", edge_mm));
  }
  SurfaceMesh halfedges = ToCgal(mesh, "remesh");
  processing::isotropic_remeshing(halfedges.faces(), edge_mm, halfedges,
                                  processing::parameters::number_of_iterations(2));
  return FromCgal(halfedges);
}

}  // namespace semblance
