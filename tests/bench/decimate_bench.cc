// SPDX-License-Identifier: GPL-3.0-or-later
// Decimation of the thesis's case, some 300 thousand triangles to 14 thousand: ours against those
// of CGAL and OpenMesh, by time, by distance and by whether the result is still a manifold; and
// what tolerances leave, and what is left of a real skull.
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "surfaces/implicit_face.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/bench/entry.h"
#include "tests/bench/real_head.h"

namespace semblance::problems {
namespace {

constexpr int kTarget = 14000;

namespace simplification = CGAL::Surface_mesh_simplification;
using CgalKernel = CGAL::Simple_cartesian<double>;
using CgalMesh = CGAL::Surface_mesh<CgalKernel::Point_3>;

CgalMesh ToCgal(const TriMesh& mesh) {
  CgalMesh halfedges;
  for (const Vec3& p : mesh.points) {
    halfedges.add_vertex({p.x(), p.y(), p.z()});
  }
  for (const Triangle& t : mesh.triangles) {
    halfedges.add_face(CgalMesh::Vertex_index(t[0]), CgalMesh::Vertex_index(t[1]),
                       CgalMesh::Vertex_index(t[2]));
  }
  return halfedges;
}

TriMesh FromCgal(CgalMesh& halfedges) {
  halfedges.collect_garbage();
  TriMesh result;
  for (const auto v : halfedges.vertices()) {
    const CgalKernel::Point_3& p = halfedges.point(v);
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

TriMesh ByLindstromTurk(const TriMesh& mesh) {
  CgalMesh halfedges = ToCgal(mesh);
  simplification::edge_collapse(halfedges,
                                simplification::Count_stop_predicate<CgalMesh>(kTarget * 3 / 2));
  return FromCgal(halfedges);
}

TriMesh ByGarlandHeckbert(const TriMesh& mesh) {
  CgalMesh halfedges = ToCgal(mesh);
  using Policies = simplification::GarlandHeckbert_plane_policies<CgalMesh, CgalKernel>;
  const Policies policies(halfedges);
  simplification::edge_collapse(halfedges,
                                simplification::Count_stop_predicate<CgalMesh>(kTarget * 3 / 2),
                                CGAL::parameters::get_cost(policies.get_cost())
                                    .get_placement(policies.get_placement())
                                    .filter(simplification::Bounded_normal_change_filter<>()));
  return FromCgal(halfedges);
}

TriMesh Ours(const TriMesh& mesh) { return Decimate(mesh, {.target_triangles = kTarget}).mesh; }

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

void Print(const std::string& name, double value, const char* unit, double at_most = kNaN) {
  bench::Print({"decimate." + name, value, kNaN, kNaN, at_most, unit, true},
               "build/tests/bench/decimate_bench");
}

void PrintRatio(const std::string& name, double ours, double peer, double goal, const char* unit) {
  bench::Print({"decimate." + name, ours, peer, peer / ours, goal, unit},
               "build/tests/bench/decimate_bench");
}

struct Way {
  std::string name;
  TriMesh (*decimate)(const TriMesh&);
  std::vector<double> seconds = {};
  Distances distances = {};

  double Median() const {
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }
};

// What a way makes of a mesh, and in what time; a later round adds its time.
void Measure(const TriMesh& dense, Way& way) {
  TriMesh coarse;
  way.seconds.push_back(bench::CpuSeconds([&] { coarse = way.decimate(dense); }));
  if (way.seconds.size() > 1) {
    return;
  }
  way.distances = Compare(dense, coarse);
  const EdgeReport edges = CheckEdges(coarse);
  Print(way.name + "_rms_mm", way.distances.rms_mm, "mm");
  Print(way.name + "_hausdorff_mm", way.distances.most_mm, "mm");
  Print(way.name + "_triangles", double(coarse.triangles.size()), "triangles");
  Print(way.name + "_faulty_edges",
        double(edges.boundary + edges.non_manifold + edges.inconsistent), "edges");
}

// All ways in turns, so that what else the machine does meets them alike.
void Compare(const std::string& subject, const TriMesh& dense, int rounds) {
  Way ours{subject + "ours", Ours}, openmesh{subject + "openmesh", ByOpenMesh},
      garland_heckbert{subject + "garland_heckbert", ByGarlandHeckbert},
      lindstrom_turk{subject + "lindstrom_turk", ByLindstromTurk};
  for (int round = 0; round < rounds; ++round) {
    for (Way* way : {&ours, &openmesh, &garland_heckbert, &lindstrom_turk}) {
      Measure(dense, *way);
    }
  }
  Print(subject + "rms_mm", ours.distances.rms_mm, "mm", 0.084);
  PrintRatio(subject + "rms_vs_openmesh", ours.distances.rms_mm, openmesh.distances.rms_mm, 1,
             "mm");
  PrintRatio(subject + "rms_vs_lindstrom_turk", ours.distances.rms_mm,
             lindstrom_turk.distances.rms_mm, 1, "mm");
  PrintRatio(subject + "vs_openmesh", ours.Median(), openmesh.Median(), 1, "s");
  PrintRatio(subject + "vs_garland_heckbert", ours.Median(), garland_heckbert.Median(), 5, "s");
  PrintRatio(subject + "vs_lindstrom_turk", ours.Median(), lindstrom_turk.Median(), kNaN, "s");
}

// What is left of a mesh within a tolerance, and how far it is off.
void Tolerances(const std::string& subject, const TriMesh& dense) {
  for (const double tolerance_mm : {0.02, 0.05, 0.1, 0.2, 0.5}) {
    const TriMesh coarse = Decimate(dense, {.tolerance_mm = tolerance_mm}).mesh;
    const std::string name = fmt::format("{}within_{}_mm", subject, tolerance_mm);
    Print(name + "_triangles", double(coarse.triangles.size()), "triangles");
    Print(name + "_hausdorff_mm", Compare(dense, coarse).most_mm, "mm", tolerance_mm);
    Print(name + "_back_mm", Compare(coarse, dense).most_mm, "mm");
  }
}

// A real skull's shell, and ever fewer triangles asked for.
void Skull(const TriMesh& shell) {
  Compare("skull_", shell, 1);
  for (const int target : {40000, 20000, 10000, 5000, 100}) {
    const DecimateResult result = Decimate(shell, {.target_triangles = target});
    const Distances distances = Compare(shell, result.mesh);
    const std::string name = fmt::format("skull_asked_{}", target);
    Print(name + "_triangles", result.summary.triangles, "triangles");
    Print(name + "_rms_mm", distances.rms_mm, "mm");
    Print(name + "_hausdorff_mm", distances.most_mm, "mm");
  }
}

void RunAll() {
  const Phantom phantom = MakePhantom({.random_seed = 1, .rings = 115});
  ImplicitFaceOptions options{.resolution = 200, .target_triangles = 10000000};
  options.field.emitter = SplitEmitter{};
  const TriMesh dense = BuildImplicitFace(phantom.skull, phantom.depth_mm, options, {}).dense;
  Compare("", dense, 5);
  Tolerances("", dense);
  if (const std::optional<TriMesh> shell = bench::RealShell("the real skull")) {
    Skull(*shell);
  }
}

}  // namespace
}  // namespace semblance::problems

int main() { semblance::problems::RunAll(); }
