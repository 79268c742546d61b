// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/dowel_projection.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/subject/sites.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

// How far along its dowel the shell lies over the base; 0 where it does not.
double GapUnderShell(const Dowel& dowel, const TriMesh& shell, const MeshQuery& query) {
  constexpr double kFurthest_mm = 40;
  double gap = 0;
  for (const MeshPoint& hit : query.AllHits(dowel.base, dowel.direction, kFurthest_mm)) {
    const Triangle& t = shell.triangles[hit.triangle];
    const bool leaves = TriangleAreaVector(shell, t).dot(dowel.direction) > 0;
    gap = leaves && hit.distance_mm <= dowel.depth_mm ? std::max(gap, hit.distance_mm) : gap;
  }
  return gap;
}

// The first way out of the shell, for a dowel that ends inside it; 0 if it is not inside.
double WayOut(const Dowel& dowel, const TriMesh& shell, const MeshQuery& query) {
  constexpr double kFurthest_mm = 40;
  const auto hit = query.FirstHit(dowel.Tip(), dowel.direction, kFurthest_mm);
  const bool inside =
      hit && TriangleAreaVector(shell, shell.triangles[hit->triangle]).dot(dowel.direction) > 0;
  return inside ? dowel.depth_mm + hit->distance_mm : 0;
}

// How far along its dowel the shell lies over the base: also of a dowel that ends under the shell.
double HeightOfShell(const Dowel& dowel, const TriMesh& shell, const MeshQuery& query) {
  const double beyond = WayOut(dowel, shell, query);
  return beyond > 0 ? beyond : GapUnderShell(dowel, shell, query);
}

// Where the shell is too high.
struct Dimple {
  Vec3 at, inward;
  double depth_mm = 0, radius_mm = 0;

  // At a point; 0 far from it.
  double DepthAt(const Vec3& p) const {
    const double r2 = (p - at).squaredNorm() / (radius_mm * radius_mm);
    return r2 < 1 ? depth_mm * (1 - r2) * (1 - r2) : 0;
  }
};

// How far p can go along `inward`, at most so far, until it meets bone: 0 on the bone, whichever
// side of it rounding puts p.
double RoomOverBone(const Vec3& p, const Vec3& inward, double at_most_mm, const MeshQuery& bone) {
  constexpr double kBack_mm = 0.5;
  const auto hit = bone.FirstHit(p - kBack_mm * inward, inward, at_most_mm + kBack_mm);
  return hit ? std::max(0.0, hit->distance_mm - kBack_mm) : at_most_mm;
}

std::vector<Dimple> DimplesOf(std::span<const Dowel> dowels, const TriMesh& shell,
                              double press_mm) {
  const MeshQuery query(shell);
  std::vector<Dimple> dimples;
  for (const Dowel& dowel : dowels) {
    const double height = HeightOfShell(dowel, shell, query),
                 wanted = dowel.depth_mm - std::min(press_mm, dowel.depth_mm);
    if (height > wanted) {
      const double depth = height - wanted;
      dimples.push_back({dowel.base + height * dowel.direction, -dowel.direction, depth,
                         std::max(10.0, 2.5 * depth)});
    }
  }
  return dimples;
}

}  // namespace

TriMesh IndentShell(TriMesh shell, std::span<const Dowel> dowels_on_bone, const TriMesh& bone,
                    double press_mm) {
  const std::vector<Dimple> dimples =
      press_mm > 0 ? DimplesOf(dowels_on_bone, shell, press_mm) : std::vector<Dimple>();
  if (dimples.empty()) {
    return shell;
  }
  const MeshQuery query(bone);
  for (Vec3& p : shell.points) {
    const auto deepest = std::ranges::max_element(
        dimples, {}, [&p](const Dimple& dimple) { return dimple.DepthAt(p); });
    if (const double depth = deepest->DepthAt(p); depth > 0) {
      p += RoomOverBone(p, deepest->inward, depth, query) * deepest->inward;
    }
  }
  return shell;
}

ProjectedDowels ProjectOntoShell(std::span<const Dowel> dowels_on_bone, const TriMesh& shell,
                                 double least_depth_mm) {
  constexpr double kWorthSaying_mm = 1;
  const MeshQuery query(shell);
  ProjectedDowels result;
  for (Dowel dowel : dowels_on_bone) {
    const double beyond = WayOut(dowel, shell, query);
    const double gap = HeightOfShell(dowel, shell, query);
    if (beyond > 0) {
      result.notes.push_back(fmt::format(
          "site {}: the dowel of {:.1f} mm ends {:.1f} mm under the shell; there the "
          "shell gets {:.1f} mm",
          SiteInWords(dowel.site), dowel.depth_mm, beyond - dowel.depth_mm, least_depth_mm));
    } else if (gap >= kWorthSaying_mm) {
      result.notes.push_back(
          fmt::format("site {}: the shell lies {:.1f} mm over the bone; of {:.1f} mm of tissue "
                      "{:.1f} mm are outside it",
                      SiteInWords(dowel.site), gap, dowel.depth_mm,
                      std::max(dowel.depth_mm - gap, least_depth_mm)));
    }
    dowel.base += gap * dowel.direction;
    dowel.depth_mm = std::max(dowel.depth_mm - gap, std::min(least_depth_mm, dowel.depth_mm));
    result.dowels_on_shell.push_back(dowel);
  }
  return result;
}

}  // namespace semblance
