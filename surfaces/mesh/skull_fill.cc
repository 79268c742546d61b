// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/skull_fill.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <algorithm>

#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/remesh.h"

namespace semblance {
namespace {

using WrapKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using WrapMesh = CGAL::Surface_mesh<WrapKernel::Point_3>;

// How far the wrap keeps from bone. Small against the pull, which takes it back.
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
  TriMesh shell;
  for (const auto v : wrap.vertices()) {
    const WrapKernel::Point_3& p = wrap.point(v);
    shell.points.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : wrap.faces()) {
    Triangle triangle;
    int corner = 0;
    for (const auto v : CGAL::vertices_around_face(wrap.halfedge(f), wrap)) {
      triangle[corner++] = static_cast<std::int32_t>(v);
    }
    shell.triangles.push_back(triangle);
  }
  return shell;
}

// Moves points near bone onto it: all the way up to pull_mm, not at all from twice that.
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

}  // namespace semblance
