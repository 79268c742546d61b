// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/propose/skull_shell.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {
namespace {

// A connected part of a mesh.
struct Body {
  double area_mm2 = 0;
  Box3 box;
};

std::vector<Body> BodiesOf(const TriMesh& mesh, const Components& components) {
  std::vector<Body> bodies(components.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Body& body = bodies[components.of_triangle[t]];
    body.area_mm2 += TriangleAreaVector(mesh, mesh.triangles[t]).norm();
    body.box.extend(TriangleCentroid(mesh, mesh.triangles[t]));
  }
  return bodies;
}

// A mandible is about 0.7 times as long as its cranium and has a quarter of its area.
void CheckOneSkull(std::vector<Body> bodies, const std::string& name) {
  std::ranges::sort(bodies, std::greater<>(), &Body::area_mm2);
  if (bodies.size() < 2) {
    return;
  }
  const double area = bodies[1].area_mm2 / bodies[0].area_mm2;
  const double length = bodies[1].box.diagonal().norm() / bodies[0].box.diagonal().norm();
  if (area > 0.5 && length > 0.8) {
    throw InputError(fmt::format(
        "{}: it has two bodies as large as a skull ({:.0f} and {:.0f} cm^2 outside); leave one "
        "skull in the file",
        name, bodies[0].area_mm2 / 100, bodies[1].area_mm2 / 100));
  }
}

TriMesh WithoutSpecks(const TriMesh& mesh, const std::string& name) {
  constexpr double kLeastArea_mm2 = 300;
  const Components components = ConnectedComponents(mesh);
  const std::vector<Body> bodies = BodiesOf(mesh, components);
  CheckOneSkull(bodies, name);
  std::vector<bool> keep(mesh.triangles.size());
  for (std::size_t t = 0; t < keep.size(); ++t) {
    keep[t] = bodies[components.of_triangle[t]].area_mm2 >= kLeastArea_mm2;
  }
  return Submesh(mesh, keep);
}

// What is seen from outside, decided on a coarser mesh, where it costs a quarter.
TriMesh OuterPart(const TriMesh& mesh, int threads) {
  constexpr double kCell_mm = 4, kNear_mm = 4, kAlike = 0.3;
  const TriMesh coarse = ClusterVertices(mesh, kCell_mm);
  const std::vector<bool> seen = SeenFromOutside(coarse, threads);
  if (std::ranges::find(seen, true) == seen.end()) {
    return {};
  }
  const SkullShell outer = AsShell(Submesh(coarse, seen));
  std::vector<std::uint8_t> keep(mesh.triangles.size());  // bytes: threads may write neighbours
  ParallelFor(keep.size(), threads, 256, [&](std::size_t t) {
    const MeshPoint near = outer.query.Closest(TriangleCentroid(mesh, mesh.triangles[t]));
    const Vec3 normal = TriangleAreaVector(mesh, mesh.triangles[t]).normalized();
    keep[t] = near.distance_mm <= kNear_mm && outer.At(near).normal.dot(normal) > kAlike ? 1 : 0;
  });
  return Submesh(mesh, {keep.begin(), keep.end()});
}

}  // namespace

ShellPoint SkullShell::At(const MeshPoint& p) const {
  const Triangle& t = mesh.triangles[p.triangle];
  const Vec3 normal =
      p.weights[0] * normals[t[0]] + p.weights[1] * normals[t[1]] + p.weights[2] * normals[t[2]];
  return {p.position, normal.normalized()};
}

ShellPoint SkullShell::Closest(const Vec3& p) const { return At(query.Closest(p)); }

SkullShell AsShell(TriMesh mesh) {
  std::vector<Vec3> normals = VertexNormals(mesh);
  MeshQuery query(mesh);
  return {.mesh = std::move(mesh), .normals = std::move(normals), .query = std::move(query)};
}

SkullShell MakeShell(const TriMesh& skull, const std::string& name, int threads) {
  constexpr double kCell_mm = 2;
  TriMesh outer = WithoutSpecks(OuterPart(ClusterVertices(skull, kCell_mm), threads), name);
  if (outer.triangles.empty()) {
    throw InputError(fmt::format(
        "{}: no body of it shows 3 cm^2 to the outside, so there is no skull; check the file",
        name));
  }
  return AsShell(std::move(outer));
}

std::vector<ShellPoint> SpreadPoints(const SkullShell& shell, double cell_mm) {
  std::set<std::array<long, 3>> taken;
  std::vector<ShellPoint> points;
  for (std::size_t t = 0; t < shell.mesh.triangles.size(); ++t) {
    const Vec3 p = TriangleCentroid(shell.mesh, shell.mesh.triangles[t]);
    const auto cell = [&](int i) { return std::lround(p[i] / cell_mm); };
    if (taken.insert({cell(0), cell(1), cell(2)}).second) {
      points.push_back(shell.At({.position = p,
                                 .triangle = static_cast<int>(t),
                                 .distance_mm = 0,
                                 .weights = Vec3::Constant(1.0 / 3)}));
    }
  }
  return points;
}

}  // namespace semblance
