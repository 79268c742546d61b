// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/site_errors.h"

#include <cmath>
#include <limits>
#include <optional>

#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

constexpr double kBehind_mm = 30, kFurthest_mm = 60;

// From base along direction to the first triangle that the ray leaves by; NaN if there is none.
double ExitAlong(const TriMesh& mesh, const MeshQuery& query, const Dowel& d, double behind_mm) {
  const Vec3 start = d.base - behind_mm * d.direction;
  for (const MeshPoint& hit : query.AllHits(start, d.direction, behind_mm + kFurthest_mm)) {
    if (TriangleAreaVector(mesh, mesh.triangles[hit.triangle]).dot(d.direction) > 0) {
      return hit.distance_mm - behind_mm;
    }
  }
  return kNaN;
}

std::optional<Vec3> NoseTip(const TriMesh& mesh, const SkullSites& sites) {
  constexpr double kAside_mm = 20, kHighest_mm = -5, kLowest_mm = -60, kRim_mm = 3;
  std::optional<Vec3> tip;
  double foremost = std::numeric_limits<double>::infinity(), height_mm = kNaN;
  for (const Triangle& t : mesh.triangles) {
    for (const auto v : t) {
      const Vec3 p = sites.InAverage(mesh.points[v]);
      const bool in_box =
          std::abs(p.x()) <= kAside_mm && p.z() <= kHighest_mm && p.z() >= kLowest_mm;
      if (in_box && p.y() < foremost) {
        foremost = p.y();
        height_mm = p.z();
        tip = mesh.points[v];
      }
    }
  }
  const bool on_rim = height_mm > kHighest_mm - kRim_mm || height_mm < kLowest_mm + kRim_mm;
  return on_rim ? std::nullopt : tip;  // brow or lips come first: there is no nose
}

}  // namespace

std::vector<SiteError> MeasureSites(const TriMesh& outer_skin, const TriMesh& face,
                                    std::span<const Dowel> landmarks) {
  const MeshQuery skin_query(outer_skin), face_query(face);
  std::vector<SiteError> errors;
  for (const Dowel& landmark : landmarks) {
    if (landmark.direction.allFinite()) {
      errors.push_back({landmark.site, ExitAlong(outer_skin, skin_query, landmark, 0),
                        ExitAlong(face, face_query, landmark, kBehind_mm)});
    }
  }
  return errors;
}

std::vector<FeatureError> MeasureFeaturePoints(const TriMesh& outer_skin, const TriMesh& face,
                                               const SkullSites& sites) {
  const std::optional<Vec3> on_truth = NoseTip(outer_skin, sites), on_face = NoseTip(face, sites);
  if (!on_truth || !on_face) {
    return {};
  }
  return {{"nose_tip", *on_truth, *on_face}};
}

}  // namespace semblance
