// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit/project_onto.h"

#include <cstdint>
#include <vector>

#include "surfaces/base/parallel.h"
#include "surfaces/marching/edge_intersections.h"

namespace semblance {
namespace {

// The crossing nearest to `p` along `normal`, within reach; p itself if there is none.
Vec3 OnSurface(const ImplicitSurface& surface, const Vec3& p, const Vec3& normal, double reach_mm) {
  constexpr int kSteps = 8;
  const EdgeSearchOptions search{.method = EdgeSearch::kRegulaFalsi, .tolerance = 1e-3};
  double from = surface.Flattened(p);
  const Vec3 step = (from > 0 ? 1 : -1) * reach_mm / kSteps * normal;
  for (int n = 0; n < kSteps; ++n) {
    const Vec3 start = p + n * step;
    const double to = surface.Flattened(start + step);
    if ((from > 0) != (to > 0)) {
      std::int64_t evaluations = 0;
      return start + SearchCrossing(
                         from, to, search,
                         [&](double t) { return surface.Flattened(start + t * step); },
                         evaluations) *
                         step;
    }
    from = to;
  }
  return p;
}

// Puts back the corners of triangles that have turned by a right angle or more, until none has.
void Unturn(const TriMesh& before, TriMesh& mesh) {
  bool turned = true;
  while (turned) {
    turned = false;
    for (const Triangle& t : mesh.triangles) {
      if (TriangleAreaVector(mesh, t).dot(TriangleAreaVector(before, t)) <= 0) {
        for (const std::int32_t v : t) {
          turned |= mesh.points[v] != before.points[v];
          mesh.points[v] = before.points[v];
        }
      }
    }
  }
}

}  // namespace

void ProjectOnto(const ImplicitSurface& surface, double reach_mm, const RunContext& context,
                 TriMesh& mesh) {
  const TriMesh before = mesh;
  const std::vector<Vec3> normals = VertexNormals(before);
  ParallelFor(mesh.points.size(), context.threads, 64, [&](std::size_t v) {
    mesh.points[v] = OnSurface(surface, before.points[v], normals[v], reach_mm);
  });
  Unturn(before, mesh);
}

}  // namespace semblance
