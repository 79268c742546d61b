// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/skin_distance.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/convex_hull_2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "surfaces/base/parallel.h"
#include "surfaces/hspline_query/hspline_batch.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance::problems {
namespace {

// Normals within 60 degrees (docs/experiments/real-heads.md). A smaller cosine matches more of the
// skin that the face meets aslant, but also more of the walls of nostrils and lids.
constexpr double kLeastCosine = 0.5;

// The middles of the cells of a columns x rows grid over the domain, i + columns * j.
std::vector<Vec2> CellMiddles(int columns, int rows) {
  std::vector<Vec2> uv;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      uv.emplace_back((i + 0.5) / columns, (j + 0.5) / rows);
    }
  }
  return uv;
}

// ---------------------------------------------------------------------------------------------
// Matching
// ---------------------------------------------------------------------------------------------

// Marks the three matches of a triangle of the grid that turns over.
void CheckTriangle(const MatchGrid& grid, const std::array<std::size_t, 3>& corners,
                   std::vector<bool>& dropped) {
  static const double kLeastTurn = std::cos(80 * std::numbers::pi / 180);
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

// ---------------------------------------------------------------------------------------------
// Measuring
// ---------------------------------------------------------------------------------------------

constexpr int kMeasuredLevel = 3, kSamplesPerPatch = 4;  // as the header states
constexpr double kFarthest_mm = 10;                      // as the header states
constexpr double kFoldCosine = -0.5;                     // of 120 degrees

struct Measured {
  double distance_mm = kNaN;  // NaN without a counterpart
  double area_mm2 = 0;        // 0 outside the face
};

SkinDistance Summarize(std::vector<Measured> all) {
  SkinDistance summary{.area_mm2 = 0};
  for (const Measured& m : all) {
    summary.area_mm2 += m.area_mm2;
  }
  std::erase_if(all,
                [](const Measured& m) { return !(m.area_mm2 > 0) || std::isnan(m.distance_mm); });
  std::ranges::stable_sort(all, {}, &Measured::distance_mm);
  double measured = 0, squares = 0;
  for (const Measured& m : all) {
    measured += m.area_mm2;
    squares += m.area_mm2 * m.distance_mm * m.distance_mm;
  }
  summary.covered = summary.area_mm2 > 0 ? measured / summary.area_mm2 : 0;
  if (all.empty()) {
    return summary;
  }
  double below = 0;
  const auto at_95 = std::ranges::find_if(
      all, [&](const Measured& m) { return (below += m.area_mm2) >= 0.95 * measured; });
  summary.rms_mm = std::sqrt(squares / measured);
  summary.p95_mm = (at_95 == all.end() ? all.back() : *at_95).distance_mm;
  summary.max_mm = all.back().distance_mm;
  return summary;
}

std::vector<Vec2> ConvexHull(const std::vector<Vec2>& points) {
  using Kernel = CGAL::Simple_cartesian<double>;
  std::vector<Kernel::Point_2> in, hull;
  for (const Vec2& p : points) {
    in.emplace_back(p.x(), p.y());
  }
  CGAL::convex_hull_2(in.begin(), in.end(), std::back_inserter(hull));
  std::vector<Vec2> corners;
  for (const Kernel::Point_2& p : hull) {
    corners.emplace_back(p.x(), p.y());
  }
  return corners;
}

}  // namespace

SkinMatcher::SkinMatcher(const TriMesh& skin) : skin_(skin, OpenBorder::kReject) {}

std::optional<SkinMatch> SkinMatcher::Find(const Vec3& point, const Vec3& normal,
                                           double reach_mm) const {
  const CorrespondenceOptions options{.reach_mm = reach_mm, .least_cosine = kLeastCosine};
  const MeshPoint closest = skin_.query().Closest(point);
  if (!(closest.distance_mm <= reach_mm)) {
    return std::nullopt;
  }
  if (skin_.Check(closest, normal, options)) {
    return SkinMatch{closest.position, closest.distance_mm};
  }
  std::optional<SkinMatch> best;
  for (const double side : {1.0, -1.0}) {
    for (const MeshPoint& hit : skin_.query().AllHits(point, side * normal, reach_mm)) {
      if (skin_.Check(hit, normal, options) && (!best || hit.distance_mm < best->distance_mm)) {
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

TemplateDistance::TemplateDistance(const TriMesh& skin, std::vector<Vec2> face)
    : skin_(skin),
      from_face_(skin, OpenBorder::kReject),
      areas_(VertexAreas(skin)),
      hull_(ConvexHull(face)) {}

bool TemplateDistance::InFace(const Vec2& uv) const {
  for (std::size_t k = 0; k < hull_.size(); ++k) {
    const Vec2 edge = hull_[(k + 1) % hull_.size()] - hull_[k], to = uv - hull_[k];
    if (edge.x() * to.y() - edge.y() * to.x() < 0) {
      return false;
    }
  }
  return true;
}

SkinDistance TemplateDistance::FaceToSkin(const HSplineSurface& surface, int threads) const {
  const HSplineShape& shape = surface.shape();
  const int columns = kSamplesPerPatch * shape.PatchesU(kMeasuredLevel),
            rows = kSamplesPerPatch * shape.PatchesV(kMeasuredLevel);
  const std::vector<Vec2> uv = CellMiddles(columns, rows);
  std::vector<Measured> measured(uv.size());
  ParallelFor(uv.size(), threads, 256, [&](std::size_t k) {
    if (!InFace(uv[k])) {
      return;
    }
    const SurfaceFrame frame = surface.Frame(uv[k]);
    const auto nearest = from_face_.Find(frame.point, Vec3::Zero(), {});
    measured[k] = {nearest ? nearest->point.distance_mm : kNaN,
                   frame.Jacobian() / (static_cast<double>(columns) * rows)};
  });
  return Summarize(std::move(measured));
}

SkinDistance TemplateDistance::SkinToFace(const HSplineSurface& surface, int threads) const {
  constexpr CorrespondenceOptions kFaces = {.reach_mm = kFarthest_mm, .least_cosine = kLeastCosine};
  const int per_patch =
      std::max(1, kSamplesPerPatch >> std::max(0, surface.shape().max_level - kMeasuredLevel));
  const Tessellation face = Tessellate(surface, per_patch);
  const Correspondences from_skin(face.mesh, face.normals);
  const std::vector<Vec3>& normals = from_face_.vertex_normals();
  std::vector<Measured> measured(skin_.points.size());
  ParallelFor(skin_.points.size(), threads, 256, [&](std::size_t k) {
    const MeshPoint nearest = from_skin.query().Closest(skin_.points[k]);
    Vec2 uv = Vec2::Zero();
    for (int c = 0; c < 3; ++c) {
      uv += nearest.weights[c] * face.uv[face.mesh.triangles[nearest.triangle][c]];
    }
    if (InFace(uv)) {
      const bool faces = from_skin.Check(nearest, normals[k], kFaces).has_value();
      measured[k] = {faces ? nearest.distance_mm : kNaN, areas_[k]};
    }
  });
  return Summarize(std::move(measured));
}

int CountFolds(const HSplineSurface& surface, int threads) {
  const HSplineShape& shape = surface.shape();
  const int columns = 2 * shape.PatchesU(shape.max_level),
            rows = 2 * shape.PatchesV(shape.max_level);
  const std::vector<Vec3> normals =
      HSplineBatch(surface).PointsAndNormals(CellMiddles(columns, rows), threads).normals;
  int folds = 0;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const std::size_t k = i + static_cast<std::size_t>(columns) * j;
      folds += i + 1 < columns && normals[k].dot(normals[k + 1]) < kFoldCosine;
      folds += j + 1 < rows && normals[k].dot(normals[k + columns]) < kFoldCosine;
    }
  }
  return folds;
}

}  // namespace semblance::problems
