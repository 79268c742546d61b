// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face_template/skin_matcher.h"

#include <array>
#include <cmath>
#include <numbers>

#include "surfaces/base/parallel.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance {
namespace {

constexpr double kLeastAgreement = 0.5;  // cosine of 60 degrees
const double kLeastTurn = std::cos(80 * std::numbers::pi / 180);

// Drops the matches of a triangle of the grid that turns over.
void CheckTriangle(MatchGrid& grid, const std::array<std::size_t, 3>& corners,
                   std::vector<bool>& dropped) {
  Vec3 normal = Vec3::Zero();
  for (const std::size_t k : corners) {
    if (!grid.skin[k]) {
      return;
    }
    normal += grid.normals[k];
  }
  const Vec3& origin = grid.skin[corners[0]]->point;
  const Vec3 area =
      (grid.skin[corners[1]]->point - origin).cross(Vec3(grid.skin[corners[2]]->point - origin));
  if (!(area.dot(normal) > kLeastTurn * area.norm() * normal.norm())) {
    for (const std::size_t k : corners) {
      dropped[k] = true;
    }
  }
}

void DropTurned(MatchGrid& grid) {
  std::vector<bool> dropped(grid.uv.size(), false);
  for (int j = 0; j + 1 < grid.rows; ++j) {
    for (int i = 0; i + 1 < grid.columns; ++i) {
      const std::size_t a = i + static_cast<std::size_t>(grid.columns) * j, b = a + 1,
                        c = a + grid.columns, d = c + 1;
      CheckTriangle(grid, {a, b, d}, dropped);
      CheckTriangle(grid, {a, d, c}, dropped);
    }
  }
  for (std::size_t k = 0; k < dropped.size(); ++k) {
    if (dropped[k]) {
      grid.skin[k].reset();
    }
  }
}

}  // namespace

std::vector<Vec2> CellMiddles(int columns, int rows) {
  std::vector<Vec2> uv;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      uv.emplace_back((i + 0.5) / columns, (j + 0.5) / rows);
    }
  }
  return uv;
}

std::vector<bool> OnBorder(const TriMesh& mesh) {
  std::vector<bool> on_border(mesh.points.size());
  for (const MeshEdge& edge : BorderEdges(mesh)) {
    on_border[edge[0]] = on_border[edge[1]] = true;
  }
  return on_border;
}

SkinMatcher::SkinMatcher(const TriMesh& skin)
    : skin_(skin), query_(skin), normals_(VertexNormals(skin)), on_border_(OnBorder(skin)) {}

bool SkinMatcher::Belongs(const MeshPoint& at, const Vec3& normal, double reach_mm) const {
  if (!(at.distance_mm <= reach_mm)) {
    return false;
  }
  Vec3 skin_normal = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    const std::int32_t vertex = skin_.triangles[at.triangle][k];
    if (on_border_[vertex]) {
      return false;
    }
    skin_normal += at.weights[k] * normals_[vertex];
  }
  return skin_normal.dot(normal) >= kLeastAgreement * skin_normal.norm();
}

std::optional<SkinMatch> SkinMatcher::Find(const Vec3& point, const Vec3& normal,
                                           double reach_mm) const {
  const MeshPoint closest = query_.Closest(point);
  if (!(closest.distance_mm <= reach_mm)) {
    return std::nullopt;
  }
  if (Belongs(closest, normal, reach_mm)) {
    return SkinMatch{closest.position, closest.distance_mm};
  }
  std::optional<SkinMatch> best;
  for (const double side : {1.0, -1.0}) {
    for (const MeshPoint& hit : query_.AllHits(point, side * normal, reach_mm)) {
      if (Belongs(hit, normal, reach_mm) && (!best || hit.distance_mm < best->distance_mm)) {
        best = SkinMatch{hit.position, hit.distance_mm};
      }
    }
  }
  return best;
}

MatchGrid MatchToSkin(const HSplineSurface& surface, const SkinMatcher& skin, int columns, int rows,
                      double reach_mm, int threads) {
  MatchGrid grid{.columns = columns,
                 .rows = rows,
                 .uv = CellMiddles(columns, rows),
                 .points = {},
                 .normals = {},
                 .skin = {}};
  SurfaceSamples samples = HSplineBatch(surface).PointsAndNormals(grid.uv, threads);
  grid.points = std::move(samples.points);
  grid.normals = std::move(samples.normals);
  grid.skin.resize(grid.uv.size());
  ParallelFor(grid.uv.size(), threads, 256, [&](std::size_t k) {
    grid.skin[k] = skin.Find(grid.points[k], grid.normals[k], reach_mm);
  });
  DropTurned(grid);
  return grid;
}

}  // namespace semblance
