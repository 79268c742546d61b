// SPDX-License-Identifier: GPL-3.0-or-later
// Decimation of the thesis's case, about 350 thousand triangles to 14 thousand: ours against other
// ways of the same libraries, by time, by distance and by whether the result is still a manifold.
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "problems/phantom.h"
#include "surfaces/decimate.h"
#include "surfaces/implicit_face.h"
#include "surfaces/mesh_query.h"
#include "tests/bench/entry.h"

namespace semblance {
namespace {

constexpr int kTarget = 14000;

TriMesh ByLindstromTurk(const TriMesh& mesh) {
  using Kernel = CGAL::Simple_cartesian<double>;
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
  namespace simplification = CGAL::Surface_mesh_simplification;
  Mesh halfedges;
  for (const Vec3& p : mesh.points) {
    halfedges.add_vertex({p.x(), p.y(), p.z()});
  }
  for (const Triangle& t : mesh.triangles) {
    halfedges.add_face(Mesh::Vertex_index(t[0]), Mesh::Vertex_index(t[1]),
                       Mesh::Vertex_index(t[2]));
  }
  simplification::edge_collapse(halfedges,
                                simplification::Count_stop_predicate<Mesh>(kTarget * 3 / 2));
  halfedges.collect_garbage();
  TriMesh result;
  for (const auto v : halfedges.vertices()) {
    const Kernel::Point_3& p = halfedges.point(v);
    result.points.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : halfedges.faces()) {
    Triangle triangle{};
    int corner = 0;
    for (const auto v : CGAL::vertices_around_face(halfedges.halfedge(f), halfedges)) {
      triangle[corner++] = static_cast<std::int32_t>(v);
    }
    result.triangles.push_back(triangle);
  }
  return result;
}

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};

TriMesh ByOpenMesh(const TriMesh& mesh) {
  using Mesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;
  Mesh halfedges;
  std::vector<Mesh::VertexHandle> vertices;
  for (const Vec3& p : mesh.points) {
    vertices.push_back(halfedges.add_vertex({p.x(), p.y(), p.z()}));
  }
  for (const Triangle& t : mesh.triangles) {
    halfedges.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
  }
  halfedges.request_face_normals();
  halfedges.update_face_normals();
  OpenMesh::Decimater::DecimaterT<Mesh> decimater(halfedges);
  OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<Mesh>::Handle flipping;
  decimater.add(quadric);
  decimater.add(flipping);
  decimater.module(quadric).unset_max_err();
  decimater.initialize();
  decimater.decimate_to_faces(0, kTarget);
  halfedges.garbage_collection();
  TriMesh result;
  for (const auto v : halfedges.vertices()) {
    const auto& p = halfedges.point(v);
    result.points.emplace_back(p[0], p[1], p[2]);
  }
  for (const auto f : halfedges.faces()) {
    Triangle triangle{};
    int corner = 0;
    for (const auto v : halfedges.fv_range(f)) {
      triangle[corner++] = v.idx();
    }
    result.triangles.push_back(triangle);
  }
  return result;
}

struct Distances {
  double rms_mm = kNaN, most_mm = kNaN;  // of the dense mesh's vertices from the coarse one
};

Distances Compare(const TriMesh& dense, const TriMesh& coarse) {
  const MeshQuery query(coarse);
  double sum = 0, most = 0;
  for (const Vec3& p : dense.points) {
    const double d = query.Closest(p).distance_mm;
    sum += d * d;
    most = std::max(most, d);
  }
  return {std::sqrt(sum / double(dense.points.size())), most};
}

struct Result {
  double seconds = kNaN;
  Distances distances;
};

template <class Way>
Result Measure(const std::string& name, const TriMesh& dense, const Way& way) {
  Result result;
  TriMesh coarse;
  result.seconds = bench::CpuSeconds([&] { coarse = way(dense); });
  result.distances = Compare(dense, coarse);
  const EdgeReport edges = CheckEdges(coarse);
  const auto print = [&](const char* what, double value, const char* unit) {
    bench::Print({fmt::format("decimate.{}_{}", name, what), value, kNaN, kNaN, kNaN, unit},
                 "build/tests/bench/decimate_bench");
  };
  print("seconds", result.seconds, "s");
  print("rms_mm", result.distances.rms_mm, "mm");
  print("hausdorff_mm", result.distances.most_mm, "mm");
  print("triangles", double(coarse.triangles.size()), "triangles");
  print("faulty_edges", double(edges.boundary + edges.non_manifold + edges.inconsistent), "edges");
  return result;
}

void RunAll() {
  const Phantom phantom = MakePhantom({.random_seed = 1, .rings = 115});
  ImplicitFaceOptions options{.resolution = 200, .target_triangles = 10000000};
  options.field.emitter = SplitEmitter{};
  const TriMesh dense = BuildImplicitFace(phantom.skull, phantom.depth_mm, options, {}).dense;
  const Result ours =
      Measure("ours", dense, [](const TriMesh& mesh) { return Decimate(mesh, kTarget); });
  const Result openmesh = Measure("openmesh", dense, ByOpenMesh);
  Measure("lindstrom_turk", dense, ByLindstromTurk);
  bench::Print(
      {"decimate.vs_openmesh", ours.seconds, openmesh.seconds, openmesh.seconds / ours.seconds, 1},
      "build/tests/bench/decimate_bench");
  bench::Print({"decimate.rms_vs_openmesh", ours.distances.rms_mm, openmesh.distances.rms_mm,
                openmesh.distances.rms_mm / ours.distances.rms_mm, 1, "mm"},
               "build/tests/bench/decimate_bench");
}

}  // namespace
}  // namespace semblance

int main() { semblance::RunAll(); }
