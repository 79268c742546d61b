// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/suggestion_check.h"

#include <algorithm>
#include <cmath>

#include "problems/subject/dowel_placement.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {
namespace {

std::vector<Vec3> BorderPoints(const TriMesh& mesh) {
  std::vector<Vec3> points;
  for (const MeshEdge& edge : BorderEdges(mesh)) {
    points.push_back(mesh.points[edge[0]]);
  }
  return points;
}

Vec3 BoneDirection(const Vec3& point, const SuggestedBone& bone) {
  constexpr double kRadius_mm = 3;  // as a depth marker's direction (PlaceOptions)
  return AveragedNormal(bone.mesh, bone.query, bone.query.Closest(point).triangle,
                        {point, kRadius_mm});
}

}  // namespace

SurfaceEnds::SurfaceEnds(const TriMesh& skull) : lids_(FindLids(skull)) {
  if (const std::vector<Vec3> borders = BorderPoints(skull); !borders.empty()) {
    borders_.emplace(borders);
  }
}

bool SurfaceEnds::IsNear(const Vec3& point, double distance_mm) const {
  return (borders_ && borders_->DistanceTo(point) < distance_mm) ||
         std::ranges::any_of(lids_, [&](const CutPlane& lid) {
           return std::abs(lid.Beyond_mm(point)) < distance_mm;
         });
}

std::string SuggestionFault(const Vec3& point, const Vec3& outward, const SuggestedBone& bone) {
  constexpr double kEnd_mm = 2;       // more would drop menton where a scan ends just below it
  constexpr double kLeave_mm = 1;     // beyond the roughness of the bone at the point itself
  constexpr double kCovered_mm = 20;  // a deep frontal sinus; the arch is farther from the ramus
  constexpr double kMinCosine = 0.26;
  if (bone.ends.IsNear(point, kEnd_mm)) {
    return "the bone ends there: the scan is cut, or the surface is broken";
  }
  const Vec3 direction = BoneDirection(point, bone);
  if (!(direction.dot(outward) > kMinCosine)) {
    return "the bone found there faces another way than this site's";
  }
  if (bone.query.FirstHit(point + kLeave_mm * direction, direction, kCovered_mm)) {
    return "the bone found there lies under other bone";
  }
  return "";
}

Vec3 SuggestedDirection(const Vec3& point, const Vec3& outward, const SuggestedBone& bone) {
  return (BoneDirection(point, bone) + outward).normalized();
}

std::optional<Vec3> FindOuterPoint(const Vec3& predicted, const Vec3& outward,
                                   const SuggestedBone& bone) {
  constexpr double kOutside_mm = 20, kInside_mm = 15;
  const auto hit =
      bone.query.FirstHit(predicted + kOutside_mm * outward, -outward, kOutside_mm + kInside_mm);
  if (!hit || !SuggestionFault(hit->position, outward, bone).empty()) {
    return std::nullopt;
  }
  return hit->position;
}

}  // namespace semblance::problems
