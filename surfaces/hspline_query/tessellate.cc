// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/tessellate.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <numeric>

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

// Samples the closed curve of one v.
PoleGap RingAt(const HSplineSurface& surface, double v) {
  constexpr int kPerPatch = 4, kMinSamples = 256;
  const HSplineShape& shape = surface.shape();
  const int count = std::max(kPerPatch * shape.PatchesU(shape.max_level), kMinSamples);
  std::vector<Vec3> ring;
  ring.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    ring.push_back(surface.Point(Vec2((k + 0.5) / count, v)));
  }
  PoleGap gap{.place = std::accumulate(ring.begin(), ring.end(), Vec3(Vec3::Zero())) / count,
              .gap_mm = 0};
  for (const Vec3& p : ring) {
    gap.gap_mm = std::max(gap.gap_mm, (p - gap.place).norm());
  }
  return gap;
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

PoleGaps PoleGapsOf(const HSplineSurface& surface) {
  return {RingAt(surface, 0), RingAt(surface, 1)};
}

bool ClosesAtPoles(const HSplineSurface& surface, const PoleGaps& gaps) {
  constexpr double kMaxRelativeGap = 0.05;
  if (surface.shape().closure != Closure::kPeriodicU) {
    return false;
  }
  double widest_mm = 0;
  for (const double v : {0.25, 0.5, 0.75}) {
    widest_mm = std::max(widest_mm, RingAt(surface, v).gap_mm);
  }
  return std::max(gaps[0].gap_mm, gaps[1].gap_mm) < kMaxRelativeGap * widest_mm;
}

void JoinPoles(const PoleGaps& gaps, Tessellation& tessellation) {
  for (const int v : {0, 1}) {
    JoinEdge(tessellation, v, gaps[v].place);
  }
}

}  // namespace semblance
