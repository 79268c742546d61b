// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/tessellate.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <functional>

#include "surfaces/base/error.h"

namespace semblance {

Tessellation Tessellate(const HSplineSurface& surface, int per_patch) {
  if (per_patch < 1) {
    throw InputError(
        fmt::format("tessellation: {} quads along a patch side; at least 1 is needed", per_patch));
  }
  const HSplineShape& shape = surface.shape();
  const int quads_u = per_patch * shape.PatchesU(shape.max_level),
            quads_v = per_patch * shape.PatchesV(shape.max_level);
  const int columns = quads_u + (shape.ClosedU() ? 0 : 1),
            rows = quads_v + (shape.ClosedV() ? 0 : 1);
  Tessellation result;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Vec2 uv(double(i) / quads_u, double(j) / quads_v);
      const SurfaceFrame frame = surface.Frame(uv);
      result.uv.push_back(uv);
      result.mesh.points.push_back(frame.point);
      result.normals.push_back(frame.Normal());
    }
  }
  for (int j = 0; j < quads_v; ++j) {
    for (int i = 0; i < quads_u; ++i) {
      const int i1 = (i + 1) % columns, j1 = (j + 1) % rows;
      const int a = i + columns * j, b = i1 + columns * j, c = i + columns * j1,
                d = i1 + columns * j1;
      result.mesh.triangles.push_back({a, b, d});
      result.mesh.triangles.push_back({a, d, c});
    }
  }
  return result;
}

namespace {

bool HasArea(const Triangle& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; }

Vec3 NormalAt(const TriMesh& mesh, std::int32_t vertex) {
  Vec3 sum = Vec3::Zero();
  for (const Triangle& t : mesh.triangles) {
    if (std::ranges::find(t, vertex) != t.end()) {
      sum += TriangleAreaVector(mesh, t);
    }
  }
  return sum.normalized();
}

void DropUnused(Tessellation& tessellation) {
  const std::vector<std::int32_t> kept = DropUnusedPoints(tessellation.mesh);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    tessellation.uv[k] = tessellation.uv[kept[k]];
    tessellation.normals[k] = tessellation.normals[kept[k]];
  }
  tessellation.uv.resize(kept.size());
  tessellation.normals.resize(kept.size());
}

}  // namespace

void JoinEdge(Tessellation& tessellation, double v, const Vec3& place) {
  TriMesh& mesh = tessellation.mesh;
  const auto is_there = [&](std::int32_t k) { return tessellation.uv[k].y() == v; };
  const auto first = std::ranges::find(tessellation.uv, v, [](const Vec2& uv) { return uv.y(); });
  if (first == tessellation.uv.end()) {
    return;
  }
  const auto pole = static_cast<std::int32_t>(first - tessellation.uv.begin());
  for (Triangle& t : mesh.triangles) {
    std::ranges::replace_if(t, is_there, pole);
  }
  std::erase_if(mesh.triangles, std::not_fn(HasArea));
  mesh.points[pole] = place;
  tessellation.normals[pole] = NormalAt(mesh, pole);
  DropUnused(tessellation);
}

}  // namespace semblance
