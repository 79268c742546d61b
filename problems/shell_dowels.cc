// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/shell_dowels.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/sites.h"
#include "surfaces/mesh_query.h"

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

}  // namespace

ShellDowels StandOnShell(std::span<const Dowel> dowels, const TriMesh& shell,
                         double least_depth_mm) {
  constexpr double kWorthSaying_mm = 1;
  const MeshQuery query(shell);
  ShellDowels result;
  for (Dowel dowel : dowels) {
    const double beyond = WayOut(dowel, shell, query);
    const double gap = beyond > 0 ? beyond : GapUnderShell(dowel, shell, query);
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
    result.dowels.push_back(dowel);
  }
  return result;
}

}  // namespace semblance
