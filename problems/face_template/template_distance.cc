// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face_template/template_distance.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/convex_hull_2.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/face_template/skin_matcher.h"
#include "surfaces/base/parallel.h"
#include "surfaces/hspline_query/hspline_batch.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance {
namespace {

constexpr int kMeasuredLevel = 3, kSamplesPerPatch = 4;
constexpr double kFarthest_mm = 10;
constexpr double kLeastAgreement = 0.5;  // cosine of 60 degrees
constexpr double kFoldCosine = -0.5;     // of 120 degrees

struct Measured {
  double distance_mm = kNaN;  // NaN without a counterpart
  double area_mm2 = 0;        // 0 beside the face
};

SkinDistance SummaryOf(std::vector<Measured> all) {
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

TemplateDistance::TemplateDistance(const TriMesh& skin, std::vector<Vec2> face)
    : skin_(skin),
      query_(skin),
      normals_(VertexNormals(skin)),
      areas_(VertexAreas(skin)),
      on_border_(OnBorder(skin)),
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
    const MeshPoint nearest = query_.Closest(frame.point);
    const auto& corners = skin_.triangles[nearest.triangle];
    const bool at_hole =
        std::ranges::any_of(corners, [&](std::int32_t c) { return on_border_[c]; });
    measured[k] = {at_hole ? kNaN : nearest.distance_mm,
                   frame.Jacobian() / (static_cast<double>(columns) * rows)};
  });
  return SummaryOf(std::move(measured));
}

SkinDistance TemplateDistance::SkinToFace(const HSplineSurface& surface, int threads) const {
  const int per_patch =
      std::max(1, kSamplesPerPatch >> std::max(0, surface.shape().max_level - kMeasuredLevel));
  const Tessellation face = Tessellate(surface, per_patch);
  const MeshQuery query(face.mesh);
  std::vector<Measured> measured(skin_.points.size());
  ParallelFor(skin_.points.size(), threads, 256, [&](std::size_t k) {
    const MeshPoint nearest = query.Closest(skin_.points[k]);
    Vec2 uv = Vec2::Zero();
    Vec3 normal = Vec3::Zero();
    for (int c = 0; c < 3; ++c) {
      const std::int32_t corner = face.mesh.triangles[nearest.triangle][c];
      uv += nearest.weights[c] * face.uv[corner];
      normal += nearest.weights[c] * face.normals[corner];
    }
    if (InFace(uv)) {
      const bool faces = normal.dot(normals_[k]) >= kLeastAgreement * normal.norm() &&
                         nearest.distance_mm <= kFarthest_mm;
      measured[k] = {faces ? nearest.distance_mm : kNaN, areas_[k]};
    }
  });
  return SummaryOf(std::move(measured));
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

}  // namespace semblance
